"""Settings of what moves in a natural world: how many, how large, how fast, and who gives way."""

from typing import Annotated, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, FiniteFloat, model_validator

from worlds.agents import DECISION, MOST, top_speed


def _ordered(bounds: tuple[float, float]) -> tuple[float, float]:
    """Refuse bounds whose first is larger than the second.

    Raises:
        ValueError: If it is.
    """
    if bounds[0] > bounds[1]:
        raise ValueError(f"expected the smaller bound first, got {bounds[0]:g}, {bounds[1]:g}")
    return bounds


Radii = Annotated[
    tuple[Annotated[FiniteFloat, Field(gt=0.02, le=5)], Annotated[FiniteFloat, Field(le=5)]],
    AfterValidator(_ordered),
]
"""Smallest and largest radius [m]."""

Heights = Annotated[
    tuple[Annotated[FiniteFloat, Field(gt=0.1)], Annotated[FiniteFloat, Field(le=4)]],
    AfterValidator(_ordered),
]
"""Smallest and largest height [m]."""

Speeds = Annotated[
    tuple[Annotated[FiniteFloat, Field(ge=0)], Annotated[FiniteFloat, Field(le=5)]],
    AfterValidator(_ordered),
]
"""Lowest and highest speed [m/s]."""

GROUP_SIZE = (2, 4)
"""Smallest and largest number of people of a group."""

HARDEST = 1.0
"""Largest difficulty."""


def number_at(number: int, difficulty: float) -> int:
    """Return a number at a difficulty; it is given at 0.5, and rises as densities do."""
    return round(number * (0.5 + difficulty))


def pace_at(difficulty: float) -> float:
    """Return the factor of speeds at a difficulty: 0.8 at 0, 1 at 0.5, 1.2 at 1 (assumption)."""
    return 0.8 + 0.4 * difficulty


class PeopleConfig(BaseModel):
    """People; numbers and speeds are those at difficulty 0.5.

    Attributes:
        alone: Number of people who go alone.
        groups: Number of groups of 2 to 4 who keep together.
        yielding: Share of those alone, and of the groups, who give way to the robot.
        radius: Smallest and largest radius [m].
        height: Smallest and largest height [m].
        speed: Lowest and highest usual speed [m/s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    alone: int = Field(default=0, ge=0, le=MOST)
    groups: int = Field(default=0, ge=0, le=MOST)
    yielding: float = Field(default=0.5, ge=0, le=1)
    radius: Radii = (0.2, 0.3)
    height: Heights = (1.5, 1.9)
    speed: Speeds = (0.5, 1.3)

    @model_validator(mode="after")
    def _check_speed(self) -> Self:
        """Refuse people who are too fast for their size."""
        _refuse_unresolved("person", self.radius, self.speed)
        return self


class AnimalConfig(BaseModel):
    """Animals that run across, pause and turn; numbers and speeds are those at difficulty 0.5.

    Attributes:
        count: Number of animals.
        radius: Smallest and largest radius [m].
        height: Smallest and largest height [m].
        speed: Lowest and highest speed of a run [m/s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    count: int = Field(default=0, ge=0, le=MOST)
    radius: Radii = (0.3, 0.45)
    height: Heights = (0.5, 1.1)
    speed: Speeds = (1.4, 2.4)

    @model_validator(mode="after")
    def _check_speed(self) -> Self:
        """Refuse animals that are too fast for their size."""
        _refuse_unresolved("animal", self.radius, self.speed)
        return self


class VehicleConfig(BaseModel):
    """Vehicles that drive to and fro on a track; numbers and speeds are those at difficulty 0.5.

    Attributes:
        count: Number of vehicles.
        radius: Smallest and largest radius [m].
        height: Smallest and largest height [m].
        speed: Lowest and highest speed [m/s].
        track: Least length of a track [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    count: int = Field(default=0, ge=0, le=MOST)
    radius: Radii = (0.8, 1.0)
    height: Heights = (1.5, 2.2)
    speed: Speeds = (0.8, 1.5)
    track: float = Field(default=15.0, ge=2, le=200)

    @model_validator(mode="after")
    def _check_speed(self) -> Self:
        """Refuse vehicles that are too fast for their size."""
        _refuse_unresolved("vehicle", self.radius, self.speed)
        return self


class WalkerConfig(BaseModel):
    """What moves in a world: upright cylinders.

    Attributes:
        count: Number of walkers that go straight and turn back at what stands, whatever the
            difficulty is.
        radius: Smallest and largest radius of those [m].
        height: Smallest and largest height of those [m].
        speed: Lowest and highest speed of those, constant for each [m/s].
        passing: Share of those, and of people alone, that appear at a time of their own and vanish
            again.
        people: People who head for places and go round solids.
        animals: Animals.
        vehicles: Vehicles.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    count: int = Field(default=0, ge=0, le=MOST)
    radius: Radii = (0.2, 0.3)
    height: Heights = (1.5, 1.9)
    speed: Speeds = (0.4, 1.2)
    passing: float = Field(default=0.25, ge=0, le=1)
    people: PeopleConfig = Field(default_factory=PeopleConfig)
    animals: AnimalConfig = Field(default_factory=AnimalConfig)
    vehicles: VehicleConfig = Field(default_factory=VehicleConfig)

    @model_validator(mode="after")
    def _check_number(self) -> Self:
        """Refuse more movers than a world may have at the largest difficulty."""
        most = self.most_at(HARDEST)
        if most > MOST:
            raise ValueError(
                f"expected at most {MOST} walkers at difficulty {HARDEST:g}, got up to {most}; "
                f"lower count, people, animals or vehicles"
            )
        return self

    @property
    def is_empty(self) -> bool:
        """True if nothing moves."""
        return self.most_at(HARDEST) == 0

    def most_at(self, difficulty: float) -> int:
        """Return the largest number of movers at a difficulty."""
        people = number_at(self.people.alone, difficulty)
        people += GROUP_SIZE[1] * number_at(self.people.groups, difficulty)
        others = (self.animals.count, self.vehicles.count)
        return self.count + people + sum(number_at(each, difficulty) for each in others)

    def scaled(self, share: float) -> "WalkerConfig":
        """Return the settings of a square with a share of the area."""
        people, animals, vehicles = self.people, self.animals, self.vehicles
        numbers = {
            "alone": round(people.alone * share),
            "groups": round(people.groups * share),
        }
        return self.model_copy(
            update={
                "count": round(self.count * share),
                "people": people.model_copy(update=numbers),
                "animals": animals.model_copy(update={"count": round(animals.count * share)}),
                "vehicles": vehicles.model_copy(update={"count": round(vehicles.count * share)}),
            }
        )


def _refuse_unresolved(kind: str, radius: tuple[float, float], speed: tuple[float, float]) -> None:
    """Refuse a speed at which the smallest goes farther than its radius in a control step.

    Raises:
        ValueError: If it does at the largest difficulty.
    """
    fastest, most = top_speed(kind, speed[1]) * pace_at(HARDEST), radius[0] / DECISION
    if fastest > most + 1e-9:
        usual = most / (top_speed(kind, 1.0) * pace_at(HARDEST))
        raise ValueError(
            f"speed: expected at most {usual:.3g} m/s of a {kind} of {radius[0]:g} m radius, which "
            f"then goes its radius in a control step of {DECISION:g} s at difficulty "
            f"{HARDEST:g}, got {speed[1]:g}; lower the speed or enlarge the radius"
        )
