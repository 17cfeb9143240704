"""Diagnosis of a scan: likely mistakes of mounting, frame or unit, and the option against each."""

import numpy as np
from numpy.typing import NDArray

from andabata.app.scanning import ScanConfig, Scanned
from traversability.binning import fill_quarters
from traversability.labels import CellState
from traversability.levelling import tilt_of

MOST_TILT = np.deg2rad(12.0)
"""Tilt of the ground [rad] above which the cloud is probably not level."""

_MOST_HEIGHT = 0.2  # Distance [m] of the ground from the base plane that needs no remark.
_OWN_REACH = 1.0  # Distance [m] from the sensor's axis within which the robot's body may be.
_OWN_RISE = 0.15  # Height [m] above which a return is not of the ground.
_OWN_POINTS = 5  # Number of returns in a sector from which on they may be the robot's body.
_LASER_REACH = 300.0  # Longest range [m] of the lasers of such robots.
_FEW = 0.01  # Share of near points below which the origin or the unit is probably wrong.


def diagnose(scanned: Scanned, config: ScanConfig) -> list[str]:
    """Return the doubts about a scan, each a sentence with the next step."""
    found = _far_remarks(scanned) or _empty_remarks(scanned)
    if not found:
        found = _ground_remarks(scanned, config)
        found += _own_body_remarks(scanned, config)
        if scanned.ground is None:
            found.append("too few points within 5 m to find the ground; is it the right cloud?")
    unknown = np.isnan(scanned.scan.ranges)
    if unknown.mean() > 0.5 and not unknown.all():
        found.append("most sectors hold no classified cell: their ranges are unknown, not free")
    return found


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
            "the coordinates millimetres? divide them by 1000"
        ]
    if nearest >= outer:
        return [
            f"expected points within {outer:g} m, got the nearest {nearest:.3g} m away; is it the "
            "right cloud?"
        ]
    return []


def _empty_remarks(scanned: Scanned) -> list[str]:
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
            "or a unit other than metres?"
        ]
    heights = points[ringed, 2].astype(np.float64)
    left = int((fill_quarters(points, grid).bins[: len(points)] >= 0).sum())
    if left == 0:
        side = "above" if heights.min() > 0 else "beyond"
        return [
            f"all points within {grid.outer_radius:g} m lie {side} the robot's height, "
            f"up to {grid.max_height:g} m over the ground: z is {heights.min():.3g} to "
            f"{heights.max():.3g} m over the base plane; are --sensor-height and --mounting right?"
        ]
    return [
        f"no cell holds {grid.min_points} points: {left} are too few in "
        f"{grid.n_sectors * grid.n_rings} cells; is the cloud thinned, or --sectors too many?"
    ]


def _ground_remarks(scanned: Scanned, config: ScanConfig) -> list[str]:
    """Return the contradictions between the ground and the mounting."""
    if scanned.ground is None or config.level:
        return []
    normal, height = scanned.ground
    tilt, sensor = tilt_of(normal), scanned.sensor
    if tilt > MOST_TILT:
        return [
            f"the ground around the robot tilts {np.rad2deg(tilt):.0f} degrees; is the cloud "
            "level? (--mounting, --level)"
        ]
    if sensor is not None and height > sensor[2] + _MOST_HEIGHT / 2:
        return [
            f"the ground is {height - sensor[2]:.2f} m above the sensor; is it mounted upside "
            "down? (--mounting 0,0,180,0,0)"
        ]
    if abs(height) <= _MOST_HEIGHT:
        return []
    where = f"the ground around the robot is at z = {height:.2f} m instead of 0"
    if sensor is None:
        return [f"{where}; is it the right frame? (--level)"]
    return [f"{where}; --sensor-height should be about {sensor[2] - height:.2f} (or --level)"]


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
