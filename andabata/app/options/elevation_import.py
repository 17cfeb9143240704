"""Options of ``world import`` for elevation models: which square, and what stands on it."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from andabata.app.options.shared import Seed
from andabata.app.options.world_import import ImportOptions

if TYPE_CHECKING:
    from andabata.app.elevation_import import ElevationRequest

_PANEL = "Elevation models"

_COMMON = ("out", "cell", "form")
"""Options of worlds of Gazebo that elevation models have, too."""


@dataclass(frozen=True)
class ElevationOptions:
    """Square of an elevation model, and what stands on it."""

    at: Annotated[
        str | None,
        typer.Option(
            metavar="LAT,LON",
            help="Place of the world's middle, in degrees (WGS 84); by default the model's middle.",
            rich_help_panel=_PANEL,
        ),
    ] = None
    size: Annotated[
        float,
        typer.Option(
            min=40, max=300, help="Edge of the square, in metres.", rich_help_panel=_PANEL
        ),
    ] = 120.0
    crs: Annotated[
        str | None,
        typer.Option(
            metavar="EPSG:...",
            help="Coordinate reference system of a file that names none.",
            rich_help_panel=_PANEL,
        ),
    ] = None
    preset: Annotated[
        str | None,
        typer.Option(
            help="Natural preset whose roughness, plants and objects are on the ground, or none; "
            "by default natural-test, and none with --objects.",
            rich_help_panel=_PANEL,
        ),
    ] = None
    difficulty: Annotated[
        float | None,
        typer.Option(
            min=0,
            max=1,
            help="Difficulty of what is on the ground; the preset's own by default.",
            rich_help_panel=_PANEL,
        ),
    ] = None
    objects: Annotated[
        Path | None,
        typer.Option(
            metavar="GEOJSON",
            help="Points with a kind (tree, bush, grass, rock, stone, log, stand, shrub, sapling, "
            "lamp, bench, table, bin) and sizes.",
            rich_help_panel=_PANEL,
        ),
    ] = None
    objects_frame: Annotated[
        str,
        typer.Option(
            help="Coordinates of the objects: degrees, longitude first, or map, metres to the east "
            "and north of the world's middle.",
            rich_help_panel=_PANEL,
        ),
    ] = "degrees"
    seed: Seed = 0

    def request(self, file: Path, common: ImportOptions) -> "ElevationRequest":
        """Return the request to import an elevation model.

        Raises:
            UsageError: If the place is none, a word is not known, or an option is for other files.
        """
        from andabata.app import elevation_import as imports
        from andabata.configuration.usage import UsageError, one_word

        others = [name for name in _given(common) if name not in _COMMON]
        if others or common.form not in ("auto", "world"):
            raise UsageError(
                f"{_names(others or ['form'])}: expected none for an elevation model, got {file}; "
                f"leave it out: the model becomes a world"
            )
        frame = one_word(self.objects_frame, (imports.DEGREES, imports.MAP), "--objects-frame")
        return imports.ElevationRequest(
            file=file,
            out=common.out,
            at=None if self.at is None else imports.place_of(self.at),
            size=self.size,
            cell=common.cell,
            crs=self.crs,
            preset=self.preset,
            difficulty=self.difficulty,
            objects=self.objects,
            objects_frame=frame,
            seed=self.seed,
        )

    def refuse(self, file: Path) -> None:
        """Refuse these options for another file.

        Raises:
            UsageError: If one is given.
        """
        from andabata.configuration.usage import UsageError

        if given := _given(self):
            raise UsageError(
                f"{_names(given)}: expected none for a world of Gazebo, got {file}; they are for "
                f"elevation models (.tif)"
            )


def _given(options: Any) -> list[str]:  # noqa: ANN401 - any group of options.
    """Return the names of the options that are not at their defaults."""
    return [each.name for each in fields(options) if getattr(options, each.name) != each.default]


def _names(options: Sequence[str]) -> str:
    """Return options as they are typed."""
    return ", ".join(f"--{name.replace('_', '-')}" for name in options)
