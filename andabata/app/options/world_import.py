"""Options of ``world import``: what is taken of a world of Gazebo, and as what."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from andabata.app.world_import import ImportRequest


@dataclass(frozen=True)
class ImportOptions:
    """What to import, and as what."""

    out: Annotated[
        Path | None,
        typer.Option(
            help="File to write: .toml for a room, .safetensors for a world; by default named "
            "after the world's file."
        ),
    ] = None
    models: Annotated[
        list[Path] | None,
        typer.Option(metavar="DIR", help="Folder of models that it includes; may be repeated."),
    ] = None
    form: Annotated[
        str,
        typer.Option(
            help="room, for planar lasers, world, of hills and objects, or auto: a room if the "
            "ground is level."
        ),
    ] = "auto"
    slab: Annotated[
        str | None,
        typer.Option(
            metavar="LOW,HIGH",
            help="Heights above the ground between which a room has obstacles, in metres; "
            "0.05,0.5 by default.",
        ),
    ] = None
    bounds: Annotated[
        str | None,
        typer.Option(
            metavar="X0,Y0,X1,Y1",
            help="Rectangle of the world to take, in metres; by default all of it and some space "
            "around.",
        ),
    ] = None
    cell: Annotated[
        float | None,
        typer.Option(min=0.02, max=2, help="Distance of a world's ground points, in metres."),
    ] = None
    ground: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="Models whose shapes are ground, as meshes of terrain and ramps; comma-separated.",
        ),
    ] = None
    name: Annotated[
        str | None, typer.Option(help="Name of the world, where the file holds several.")
    ] = None
    allow_missing: Annotated[
        bool,
        typer.Option("--allow-missing", help="Leave out models and meshes that are not found."),
    ] = False

    def request(self, file: Path) -> "ImportRequest":
        """Return the request to import a world's file.

        Raises:
            UsageError: If the form, the heights or the rectangle are not what they have to be.
        """
        from andabata.app import world_import as imports
        from andabata.configuration.usage import words

        (form, *_) = words(self.form, (imports.AUTO, imports.ROOM, imports.WORLD), "--form")
        names = () if self.ground is None else self.ground.split(",")
        return imports.ImportRequest(
            file=file,
            out=self.out,
            folders=self.models or (),
            name=self.name,
            form=form,
            slab=None if self.slab is None else imports.slab_of(self.slab),
            bounds=None if self.bounds is None else imports.bounds_of(self.bounds),
            cell=self.cell,
            ground=tuple(each.strip() for each in names),
            allow_missing=self.allow_missing,
        )
