"""Diagnosis of a scan: likely mistakes of mounting, frame or unit, and the option against each."""

import numpy as np
from numpy.typing import NDArray

from andabata.scanning.explanations import (
    MAX_HEIGHT,
    MAX_TILT,
    CloudOrigin,
    could_be_feet,
    explain,
    is_level_ground,
)
from andabata.scanning.scan import ScanConfig, Scanned
from traversability.binning import fill_quarters
from traversability.labels import CellState
from traversability.levelling import levelled, tilt_of

_LEAST_OVER, _MOST_OVER = 0.1, 10.0
"""Heights over the ground between which a sensor may be mounted [m]."""

_SECTORS = 32
"""Number of sectors without ``--sectors``."""

_OWN_REACH = 1.0  # Distance [m] from the sensor's axis within which the robot's body may be.
_OWN_RISE = 0.15  # Height [m] above which a return is not of the ground.
_OWN_POINTS = 5  # Number of returns in a sector from which on they may be the robot's body.
_LASER_REACH = 300.0  # Longest range [m] of the lasers of such robots.
_FEW = 0.01  # Share of near points below which the origin or the unit is probably wrong.


def diagnose(scanned: Scanned, config: ScanConfig, origin: CloudOrigin | None = None) -> list[str]:
    """Return the doubts about a scan, each a sentence with the next step.

    Args:
        scanned: Scan of a cloud.
        config: Settings of the scan.
        origin: History of the cloud before the scan; None for a cloud in metres.
    """
    origin = origin or CloudOrigin()
    doubts = _explained(scanned, config, origin)
    doubts = doubts or _far_remarks(scanned) or _empty_remarks(scanned, config, origin)
    if not doubts:
        # Ground that is not in its place looks like a body over it.
        doubts = _ground_remarks(scanned, config, origin) or _own_body_remarks(scanned, config)
        if scanned.ground is None:
            doubts.append("too few points within 5 m to find the ground; is it the right cloud?")
    unknown = np.isnan(scanned.scan.ranges)
    if unknown.mean() > 0.5 and not unknown.all():
        doubts.append("most sectors hold no classified cell: their ranges are unknown, not free")
    return doubts


def _explained(scanned: Scanned, config: ScanConfig, origin: CloudOrigin) -> list[str]:
    """Return what puts the ground in its place, if no height of the sensor does."""
    plane, sensor = scanned.ground, scanned.sensor
    over = 0.0 if plane is None or sensor is None else float(sensor[2] - plane[1])
    level = plane is not None and tilt_of(plane[0]) <= MAX_TILT
    if level and _LEAST_OVER <= over <= _MOST_OVER:
        return []
    text = explain(scanned, config, origin)
    return [] if text is None else [text]


def _outward(scanned: Scanned) -> NDArray[np.float64]:
    """Return the horizontal distance of each point [m], shape (n,)."""
    x, y = scanned.cloud.points[:, :2].T.astype(np.float64)
    return np.hypot(x, y)


def _far_remarks(scanned: Scanned) -> list[str]:
    """Return the reason why hardly a point is near the robot: another origin, another unit."""
    outward, outer = _outward(scanned), scanned.grid.outer_radius
    if not len(outward) or (outward < outer).mean() > _FEW:
        return []
    nearest, middle = float(outward.min()), float(np.median(outward))
    wide = float(np.ptp(scanned.cloud.points[:, :2].astype(np.float64), axis=0).max())
    if nearest > max(wide, outer):
        return [
            f"the cloud's nearest point is {nearest:.4g} m from the sensor, and the cloud is "
            f"{wide:.3g} m wide: the sensor is not their origin; give the sensor's "
            "position with --sensor-at X,Y,Z"
        ]
    if middle > _LASER_REACH:
        return [
            f"half of the points are more than {middle:.4g} m away, further than lasers reach: are "
            "the coordinates metres? (--unit gives the length of another unit)"
        ]
    if nearest >= outer:
        return [
            f"expected points within {outer:g} m, got the nearest {nearest:.3g} m away; is it the "
            "right cloud?"
        ]
    return []


def _empty_remarks(scanned: Scanned, config: ScanConfig, origin: CloudOrigin) -> list[str]:
    """Return the reason why no cell could be classified."""
    if (scanned.cells != CellState.EMPTY).any():
        return []
    grid, points = scanned.grid, scanned.cloud.points
    outward = _outward(scanned)
    ringed = (outward >= grid.inner_radius) & (outward < grid.outer_radius)
    if not ringed.any():
        return [
            f"all {len(points)} points lie within {grid.inner_radius:g} m of the robot's axis, "
            f"nearer than the first ring (farthest {outward.max():.3g} m): the robot's own body, "
            "or a unit other than metres? (--unit)"
        ]
    heights = points[ringed, 2].astype(np.float64)
    left = int((fill_quarters(points, grid).bins[: len(points)] >= 0).sum())
    if left == 0:
        side = "above" if heights.min() > 0 else "beyond"
        return [
            f"all points within {grid.outer_radius:g} m lie {side} the robot's height, "
            f"up to {grid.max_height:g} m over the ground: z is {heights.min():.3g} to "
            f"{heights.max():.3g} m over the base plane"
            f"{_height_step(scanned, config, origin) or '; is the sensor mounted so?'}"
        ]
    few = f"no cell holds {grid.min_points} points: {left} are too few in "
    few += f"{grid.n_sectors * grid.n_rings} cells; "
    if grid.n_sectors > _SECTORS and _fills_a_cell(points[ringed], scanned):
        return [f"{few}larger sectors hold more: --sectors {_SECTORS}"]
    return [f"{few}is the cloud thinned?"]


def _fills_a_cell(points: NDArray[np.float32], scanned: Scanned) -> bool:
    """Return True if some cell would hold enough points with as many sectors as usual."""
    grid, (x, y) = scanned.grid, points[:, :2].T.astype(np.float64)
    edges = np.linspace(-np.pi, np.pi, _SECTORS + 1)
    counts, _, _ = np.histogram2d(np.arctan2(y, x), np.hypot(x, y), (edges, grid.ring_edges))
    return bool((counts >= grid.min_points).any())


def _ground_remarks(scanned: Scanned, config: ScanConfig, origin: CloudOrigin) -> list[str]:
    """Return the contradictions between the ground and the mounting."""
    if scanned.ground is None or config.level:
        return []
    normal, height = scanned.ground
    tilt, sensor = tilt_of(normal), scanned.sensor
    if tilt > MAX_TILT:
        return [
            f"the ground around the robot tilts {np.rad2deg(tilt):.0f} degrees; is the cloud "
            f"level? ({_tilt_options(scanned)})"
        ]
    if abs(height) <= MAX_HEIGHT:
        return []
    where = f"the ground around the robot is at z = {height:.2f} m instead of 0"
    if sensor is None:
        return [f"{where}; is it the right frame? (--level)"]
    return [f"{where}{_height_step(scanned, config, origin)}"]


def _tilt_options(scanned: Scanned) -> str:
    """Return the options against tilted ground, ``--level`` only where it levels the ground."""
    base = scanned.sensor is None
    option = f"--mounting {'laser=X,Y,Z' if base else 'X,Y'},ROLL,PITCH,YAW"
    points, plane = scanned.cloud.points, scanned.ground
    levels = plane is not None and is_level_ground(levelled(points, plane, scanned.sensor))
    return f"{option}, --level" if levels else option


def _height_step(scanned: Scanned, config: ScanConfig, origin: CloudOrigin) -> str:
    """Return the option that puts level ground in the base plane; empty if there is none.

    A sensor's height explains it, unless the origin is in the ground or below, or too high up: then
    the origin is no sensor.
    """
    if scanned.ground is None or tilt_of(scanned.ground[0]) > MAX_TILT or config.level:
        return ""
    sensor, height = scanned.sensor, scanned.ground[1]
    if sensor is None:
        return "; is it the right frame? (--level)"
    over = float(sensor[2] - height)
    if _LEAST_OVER <= over <= _MOST_OVER:
        feet = could_be_feet(scanned, config, origin)
        more = ", or --unit 0.3048 if the coordinates are feet" if feet else ""
        return (
            f"; --sensor-height should be about {over:.2f} (Z in --mounting if it has one){more}; "
            "or --level"
        )
    side = "above" if over > 0 else "below"
    where = f": the cloud's origin is {abs(over):.2f} m {side} the ground, where no sensor is; "
    if origin.has_viewpoint:
        return f"{where}is VIEWPOINT where the sensor was? (--sensor-at X,Y,Z overrides it)"
    shift = config.mounting.rotation.inv().apply([0.0, 0.0, height])
    x, y, z = np.array(config.sensor_at or (0.0, 0.0, 0.0)) + shift
    own = (x / origin.across, y / origin.across, z / origin.up)
    place = ",".join(f"{round(float(number), 2) + 0.0:.10g}" for number in own)
    base = (
        ", or if it is a base on the ground, --sensor-height 0" if abs(over) < _LEAST_OVER else ""
    )
    return f"{where}if the sensor is over it, give --sensor-at {place}{base}"


def _own_body_remarks(scanned: Scanned, config: ScanConfig) -> list[str]:
    """Return a remark if sectors end at what may be the robot's own body."""
    grid, ranges = scanned.grid, scanned.scan.ranges
    with np.errstate(invalid="ignore"):
        short = ranges < _OWN_REACH
    if not short.any():
        return []
    points = scanned.cloud.points.astype(np.float64)
    sensor = np.zeros(3) if scanned.sensor is None else scanned.sensor
    bearing = np.arctan2(points[:, 1], points[:, 0])
    sector = ((bearing + np.pi) / (2 * np.pi) * grid.n_sectors).astype(int) % grid.n_sectors
    ground = 0.0 if scanned.ground is None or config.level else scanned.ground[1]
    near = np.hypot(*(points - sensor)[:, :2].T) < _OWN_REACH
    over = (points[:, 2] > ground + _OWN_RISE) & (points[:, 2] < ground + grid.max_height)
    own = near & over & (_outward(scanned) >= grid.inner_radius) & short[sector]
    counts = np.bincount(sector[own], minlength=grid.n_sectors)
    blocked = counts >= _OWN_POINTS
    if not blocked.any():
        return []
    reach = float(np.linalg.norm((points - sensor)[own & blocked[sector]], axis=1).max())
    radius = min(np.ceil(10 * (reach + 0.05)) / 10, 5.0)
    return [
        f"{int(blocked.sum())} of {grid.n_sectors} sectors end within {_OWN_REACH:g} m at returns "
        f"above the ground: if they are the robot's own body, leave them out with --own-body "
        f"{radius:.1f}"
    ]
