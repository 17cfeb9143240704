"""Settings of the occupancy grid."""

from pydantic import BaseModel, ConfigDict, Field

from traversability.cartesian.rolling_grid import PowerOfTwo


class OccupancyGridConfig(BaseModel):
    """Settings of the occupancy grid.

    Attributes:
        cells: Number of cells along an edge of the square around the robot.
        cell: Edge of a cell [m].
        update_every: Number of scans, one a control step, between two that are taken in.
        certain_blocked: Log odds, above those from which on a polar cell is called blocked, at
            which it is certainly so. Less moves a cell to its share of ``max_log_odds``.
        certain_free: Log odds below those at which a polar cell is certainly free.
        blocked_gain: Share of its way that a blocked polar cell right ahead moves the log odds.
        free_gain: Share that a free one moves them the other way.
        unknown_gain: Log odds that an empty polar cell adds, with nothing in front of it that could
            hide it: an edge behind which the ground falls away shows no more. Two seconds are
            enough for an obstacle, so that a robot at 0.6 m/s still stops before it.
        unknown_range: Range beyond which empty polar cells do not count [m].
        blocked_range: Range beyond which blocked polar cells do not count where ground cells are
            classified [m]: they are a metre long and wide, and ground cells show what stands where
            in them.
        range_scale: Range at which a scan weighs half as much as right ahead [m]: polar cells grow
            with the range.
        max_log_odds: Largest log odds; from afar that weight of it. Ground that was driven has once
            to twice as much against an obstacle.
        driven_memory: Number of scans after which driven ground is ground like any other: dead
            reckoning has drifted by then, the edges of the trail sooner than its middle.
        lethal_log_odds: Log odds above which a cell is an obstacle.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    cells: PowerOfTwo = Field(default=256, ge=64, le=1024)
    cell: float = Field(default=0.2, gt=0)
    update_every: int = Field(default=5, ge=1)
    certain_blocked: float = Field(default=3.6, gt=0)
    certain_free: float = Field(default=2.0, gt=0)
    blocked_gain: float = Field(default=0.4, gt=0, le=1)
    free_gain: float = Field(default=0.05, gt=0, le=1)
    unknown_gain: float = Field(default=0.3, ge=0)
    unknown_range: float = Field(default=4.0, ge=0)
    blocked_range: float = Field(default=5.0, ge=0)
    range_scale: float = Field(default=3.0, gt=0)
    max_log_odds: float = Field(default=3.0, gt=0)
    driven_memory: int = Field(default=600, ge=1)
    lethal_log_odds: float = Field(default=1.0, gt=0)
