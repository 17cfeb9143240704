"""Moving obstacles as data: round, there always or for a while, and how those outdoors go."""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator

FASTEST = 5.0
"""Largest speed of a mover [m/s]."""


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
        course: Times since the robot's start [s], the first one 0, and places [m]: it goes straight
            from each place to the next, whatever stands there, and begins anew at the last time.
            Empty for one that goes straight and turns back at what stands.
        is_person: True for a person, who heads for one place of the room after the other, goes
            round what stands and steps aside for others; see ``worlds.agent_motion``.
        yields: True for a person who steps aside for the robot, too.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    radius: float = Field(gt=0.02, le=5)
    height: float = Field(default=1.7, gt=0.1, le=4)
    place: tuple[float, float] | None = None
    speed: float = Field(default=0.0, ge=0, le=FASTEST)
    heading_deg: float | None = Field(default=None, ge=-360, le=360)
    when_within: float | None = Field(default=None, gt=0)
    appears_at: float = Field(default=0.0, ge=0)
    duration: float | None = Field(default=None, gt=0)
    course: tuple[tuple[FiniteFloat, FiniteFloat, FiniteFloat], ...] = ()
    is_person: bool = False
    yields: bool = False

    @model_validator(mode="after")
    def _check_person(self) -> Self:
        """Refuse people who stand for ever or follow a course, and others who give way."""
        if self.is_person and (self.speed == 0 or self.course):
            raise ValueError(
                f"is_person: expected a speed and no course beside it, got {self.speed:g} m/s and "
                f"{len(self.course)} places; give one, or leave is_person out"
            )
        if self.yields and not self.is_person:
            raise ValueError("yields: expected is_person beside it, got none; set it, too")
        return self

    @model_validator(mode="after")
    def _check_course(self) -> Self:
        """Refuse courses that do not begin at once in their place, or are too fast to follow."""
        if not self.course:
            return self
        times = [time for time, _, _ in self.course]
        spans = [later - time for time, later in pairwise(times)]
        if times[0] != 0 or not spans or min(spans) <= 0:
            raise ValueError(
                f"course: expected ascending times from 0 on, two or more, got {times}"
            )
        if self.place != self.course[0][1:]:
            raise ValueError(
                f"place: expected the begin of its course, {self.course[0][1:]}, got {self.place}"
            )
        ways = [math.dist(here[1:], there[1:]) for here, there in pairwise(self.course)]
        fastest = max(way / span for way, span in zip(ways, spans, strict=True))
        if fastest > FASTEST:
            raise ValueError(f"course: expected at most {FASTEST} m/s, got {fastest:.3g}")
        if self.speed or self.when_within is not None or self.appears_at or self.duration:
            raise ValueError(
                "course: expected no speed, when_within, appears_at or duration beside it"
            )
        return self

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


class Behaviour(BaseModel):
    """How a mover of a natural world goes; see ``worlds.agents`` for the law of each kind.

    Attributes:
        kind: ``person``, ``animal`` or ``vehicle``.
        seed: Seed of its own decisions: where a person goes next, when an animal turns.
        yields: True for a person that gives way to the robot.
        leader: Index, among the movers of the world, of the person that it keeps with; None for one
            that goes alone or leads.
        slot: Place beside that person, ahead and to the left of it [m].
        track: Corners of a vehicle's track, which it drives to and fro [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["person", "animal", "vehicle"]
    seed: int = Field(default=0, ge=0, lt=2**63)
    yields: bool = False
    leader: int | None = Field(default=None, ge=0)
    slot: tuple[FiniteFloat, FiniteFloat] = (0.0, 0.0)
    track: tuple[tuple[FiniteFloat, FiniteFloat], ...] = ()

    @model_validator(mode="after")
    def _check_kind(self) -> Self:
        """Refuse what only another kind has."""
        if self.kind == "vehicle" and len(self.track) < 2:
            raise ValueError(f"track: expected two corners or more, got {len(self.track)}")
        if self.kind != "vehicle" and self.track:
            raise ValueError(
                f"track: expected none of a {self.kind}, got {len(self.track)} corners"
            )
        if self.kind != "person" and (self.yields or self.leader is not None):
            raise ValueError(f"yields, leader: expected those of a person, got kind {self.kind}")
        return self


@dataclass(frozen=True)
class Mover:
    """A moving obstacle of one episode.

    Attributes:
        place: Centre where it begins [m].
        velocity: Velocity with which it begins [m/s].
        plan: Plan that it was drawn from.
        behaviour: How it goes on; None goes straight and turns back at what stands.

    Raises:
        ValueError: If place or velocity are not finite.
    """

    place: tuple[float, float]
    velocity: tuple[float, float]
    plan: MoverPlan
    behaviour: Behaviour | None = None

    @property
    def kind(self) -> str:
        """Kind of its behaviour; ``walker`` for one that goes straight."""
        return "walker" if self.behaviour is None else self.behaviour.kind

    def __post_init__(self) -> None:
        """Refuse places and velocities that are no numbers."""
        for name, (x, y) in (("place", self.place), ("velocity", self.velocity)):
            if not (math.isfinite(x) and math.isfinite(y)):
                raise ValueError(
                    f"mover.{name}: expected two finite numbers, got {x}, {y}; correct them"
                )
