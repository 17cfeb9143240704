"""Units of a file's coordinates, horizontal and vertical, in one value."""

from typing import NamedTuple

from traversability.formats.length_units import METRE, LengthUnit, unit_of_length

GEOGRAPHIC = (
    "expected coordinates in a unit of length, got degrees of a geographic system; project the "
    "file to one in metres, such as the UTM zone of the place"
)
"""Text of the error of longitudes and latitudes."""

GEOCENTRIC = (
    "expected coordinates whose z points up, got those of a geocentric system; project the file "
    "to one in metres, such as the UTM zone of the place"
)
"""Text of the error of coordinates that count from the Earth's centre."""

GIVE = "give its length in metres with --unit"
"""Next step where a unit is unknown."""


class CoordinateUnits(NamedTuple):
    """Units of a file's own coordinates.

    Attributes:
        horizontal: Unit of x and y.
        vertical: Unit of z, or None where the file names none: then it is that of x and y.
        is_assumed: True if the file names a system and no unit: then they are metres.
    """

    horizontal: LengthUnit = METRE
    vertical: LengthUnit | None = None
    is_assumed: bool = False

    @classmethod
    def given(cls, metres: float) -> "CoordinateUnits":
        """Return the units of coordinates that all count in one length [m]."""
        unit = unit_of_length(metres)
        return cls(unit, unit)

    @property
    def metres(self) -> tuple[float, float]:
        """Lengths of both units, horizontal and vertical [m]."""
        return self.horizontal.metres, (self.vertical or self.horizontal).metres

    def remarks(self, source: str) -> tuple[str, ...]:
        """Return what is converted or assumed, in words; nothing if all is in metres.

        Args:
            source: Source of the units: a part of the file, or an option.
        """
        across, up = self.metres
        if self.is_assumed:
            return (
                f"{source} name a plane and no unit: x and y are taken as metres; --unit gives the "
                "length of another unit",
            )
        if (across, up) == (1.0, 1.0):
            return ()
        names = f"coordinates in {_in_words(self.horizontal)}"
        if self.vertical is not None and across != up:
            names = f"x and y in {_in_words(self.horizontal)} and z in {_in_words(self.vertical)}"
        same = "; nothing names the unit of z: the same" if self.vertical is None else ""
        return (
            f"{names}, by {source}, are converted to metres; --sensor-at stays in the "
            f"file's own units{same}",
        )


def _in_words(unit: LengthUnit) -> str:
    """Return a unit's name with its length."""
    return unit.name if unit == METRE else f"{unit.name} ({unit.metres:.7g} m)"


METRES = CoordinateUnits()
"""Units of files that name none."""
