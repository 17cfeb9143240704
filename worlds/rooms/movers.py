"""Moving obstacles as data: round, with a constant speed, there always or for a while."""

import math
from dataclasses import dataclass
from typing import Self

from pydantic import BaseModel, ConfigDict, Field, model_validator


class MoverPlan(BaseModel):
    """A round obstacle that moves, or comes and goes.

    Attributes:
        radius: Radius [m].
        height: Height on natural ground [m]; in rooms lasers meet it at any height.
        place: Centre where it begins [m]; None draws a free place for each episode.
        speed: Speed, the same for ever [m/s]; 0 stands.
        heading_deg: Direction in which it begins, counter-clockwise from x [deg]; None draws one
            for each episode.
        when_within: Distance of the robot from the obstacle's edge below which it appears [m]; None
            leaves that to the time alone.
        appears_at: Time since the robot's start before which it does not appear [s].
        duration: Time after its appearance at which it vanishes for good [s]; None keeps it.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    radius: float = Field(gt=0.02, le=5)
    height: float = Field(default=1.7, gt=0.1, le=4)
    place: tuple[float, float] | None = None
    speed: float = Field(default=0.0, ge=0, le=5)
    heading_deg: float | None = Field(default=None, ge=-360, le=360)
    when_within: float | None = Field(default=None, gt=0)
    appears_at: float = Field(default=0.0, ge=0)
    duration: float | None = Field(default=None, gt=0)

    @model_validator(mode="after")
    def _check_place(self) -> Self:
        """Refuse obstacles that wait for the robot nowhere in particular."""
        if self.when_within is not None and self.place is None:
            raise ValueError("place: expected one where when_within is given, got none")
        return self

    @property
    def circle(self) -> tuple[float, float, float]:
        """Centre and radius where it begins [m].

        Raises:
            ValueError: If the place is drawn for each episode.
        """
        if self.place is None:
            raise ValueError("place: expected one that is the same in all episodes, got none")
        return (*self.place, self.radius)

    def is_due(self, x: float, y: float) -> bool:
        """Return True if the robot is near enough for the obstacle to appear.

        Args:
            x: Place of the robot [m].
            y: Place of the robot [m].
        """
        if self.when_within is None:
            return True
        centre_x, centre_y, radius = self.circle
        return math.hypot(x - centre_x, y - centre_y) - radius < self.when_within


@dataclass(frozen=True)
class Mover:
    """A moving obstacle of one episode.

    Attributes:
        place: Centre where it begins [m].
        velocity: Velocity with which it begins [m/s].
        plan: Plan that it was drawn from.
    """

    place: tuple[float, float]
    velocity: tuple[float, float]
    plan: MoverPlan
