"""Arrival at a goal: the robot declares it from its own estimate, and stands still from then on.

It drives on to ``ArrivalConfig.distance`` of its goal. A goal may lie where the robot cannot go: in
or beside an obstacle as its own map has it, since its estimate is off, or inside its turning
circle. While it comes no nearer, a larger distance is accepted.
"""

import math

from pydantic import BaseModel, ConfigDict, Field

from andabata.localization.localizer import Health

ARRIVAL_DISTANCE = 0.3
"""Distance from the goal at which a robot has arrived unless it is set otherwise [m]."""

_PROGRESS = 0.05
"""Distance by which a robot has to come nearer for it to count [m]."""

_HEALTHY = (Health.OK, Health.DEGRADED)
"""Health of an estimate that a robot may stop by."""


class ArrivalConfig(BaseModel):
    """Rules by which a robot declares that it has reached a goal (assumption).

    Attributes:
        distance: Estimated distance to the goal at which it is reached [m].
        max_distance: Largest distance that is accepted where the robot comes no nearer [m]; not
            less than ``distance``, which is accepted in any case.
        patience: Time without coming nearer after which ``max_distance`` is accepted [s]; before,
            the accepted distance grows in proportion to the time.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    distance: float = Field(default=ARRIVAL_DISTANCE, gt=0)
    max_distance: float = Field(default=1.0, gt=0)
    patience: float = Field(default=10.0, gt=0)


class ArrivalMonitor:
    """Decides by the estimated distance whether the goal is reached; once said, it stays said.

    Attributes:
        has_arrived: True from the declaration on, whatever a later fix makes of the estimate.
    """

    def __init__(self, config: ArrivalConfig) -> None:
        """Begin on the way to a goal.

        Args:
            config: Rules.
        """
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Begin on the way to another goal."""
        self.has_arrived = False
        self._nearest = self._last = math.inf
        self._progress_stamp = -math.inf

    def update(self, distance: float, stamp: float, health: Health) -> bool:
        """Return True if the goal is reached.

        Args:
            distance: Estimated horizontal distance to the goal [m].
            stamp: Time [s].
            health: Health of the estimate. A robot that is lost, or lacks a heading, declares
                nothing.
        """
        is_healthy = health in _HEALTHY
        # Without a usable estimate the robot does not try, so that no time counts as tried.
        if distance < self._nearest - _PROGRESS or not is_healthy:
            self._nearest, self._progress_stamp = min(self._nearest, distance), stamp
        comes_nearer, self._last = distance < self._last, distance
        if is_healthy and not self.has_arrived:
            accepted = self._accepted_distance(stamp, comes_nearer)
            self.has_arrived = distance <= accepted
        return self.has_arrived

    def stalled_time(self, stamp: float) -> float:
        """Return the time since the robot was last nearer to the goal than before [s]."""
        return max(stamp - self._progress_stamp, 0.0) if math.isfinite(self._nearest) else 0.0

    def _accepted_distance(self, stamp: float, comes_nearer: bool) -> float:
        """Return the distance at which the goal counts as reached [m]."""
        config = self._config
        # A robot that circles about its goal stops where it is nearest.
        if comes_nearer:
            return config.distance
        share = min((stamp - self._progress_stamp) / config.patience, 1.0)
        return config.distance + share * max(config.max_distance - config.distance, 0.0)
