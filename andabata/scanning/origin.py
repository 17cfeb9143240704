"""Position of the sensor in a cloud's own coordinates: given by the user, or by the file."""

from dataclasses import replace

import numpy as np

from traversability.decoding import DecodedCloud

Position = tuple[float, float, float]
"""Coordinates x, y, z."""


def from_the_sensor(
    decoded: DecodedCloud, given: Position | None
) -> tuple[DecodedCloud, Position | None]:
    """Return a cloud in its sensor's frame as far as the file says, and where the sensor is in it.

    Args:
        decoded: Cloud of a file or a recording.
        given: Position that the user gives, in the file's own unit; it overrides the file's.

    Returns:
        Cloud; and position in its coordinates [m], or None if it is their origin.
    """
    viewpoint, (across, up) = decoded.viewpoint, decoded.units.metres
    if given is not None:
        x, y, z = given
        return decoded, (x * across, y * across, z * up)
    if viewpoint is None:
        return decoded, None
    x, y, z = viewpoint.position.tolist()
    place = ",".join(f"{number:.10g}" for number in (x / across, y / across, z / up))
    if viewpoint.contradicts(decoded.cloud):
        return decoded.noting(
            f"VIEWPOINT {place} is not among the points, which surround their origin: read as "
            f"points in the sensor's own frame; --sensor-at {place} takes them from there"
        ), None
    turned = np.rad2deg(viewpoint.rotation.magnitude())
    return replace(decoded, cloud=viewpoint.seen_from(decoded.cloud)).noting(
        f"points are taken from VIEWPOINT: the sensor at {place}, turned by {turned:.0f} degrees; "
        "--sensor-at 0,0,0 reads them as points in the sensor's own frame"
    ), None
