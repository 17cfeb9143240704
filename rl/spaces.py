"""Spaces of a policy: named parts of the observation, named actions; stored with every policy.

An observation is one float32 vector, the parts one after the other. A set of k points is a part of
shape (k, 2) with a part of shape (k,) beside it that masks the points that count.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache
from itertools import accumulate
from math import prod
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

MIDDLE_RANGE = 2.0
"""Range that is neither near nor far for the networks [m]."""

MIN_POINT_RANGE = 0.02
"""Smallest range that a point is made of [m]: reciprocals stay finite at contact."""

Scaling = Literal["linear", "proximity", "none"]
"""Scaling of a term for networks: division by its upper bound, nearness (ranges), or none."""


class ObservationTerm(BaseModel):
    """A named part of the observation.

    Attributes:
        name: Name, unique in its spec.
        shape: Shape of the part.
        low: Lowest value [unit].
        high: Highest value [unit].
        unit: SI unit of the values.
        scaling: ``linear`` divides by ``high``. ``proximity`` bends ranges: 1 at contact, 0 at
            ``MIDDLE_RANGE``, towards -1 in the open, since a decimetre matters near the body and
            not ten metres away (assumption). ``none`` takes values as they are.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = Field(min_length=1)
    shape: tuple[int, ...]
    low: float
    high: float
    unit: str
    scaling: Scaling = "linear"

    @property
    def size(self) -> int:
        """Number of values."""
        return prod(self.shape)


class ObservationSpec(BaseModel):
    """Layout of an observation vector.

    Attributes:
        terms: Parts in their order.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    terms: tuple[ObservationTerm, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _check_names(self) -> Self:
        names = [term.name for term in self.terms]
        if len(set(names)) < len(names):
            raise ValueError(f"terms: expected names of their own, got {names}")
        return self

    @cached_property
    def size(self) -> int:
        """Length of the vector (paper: 35)."""
        return sum(term.size for term in self.terms)

    def term(self, name: str) -> ObservationTerm:
        """Return a part by its name.

        Raises:
            KeyError: If there is none.
        """
        for term in self.terms:
            if term.name == name:
                return term
        raise KeyError(f"term: expected one of {[one.name for one in self.terms]}, got {name!r}")

    def slice_of(self, name: str) -> slice:
        """Return where a part stands in the vector.

        Raises:
            KeyError: If there is none.
        """
        self.term(name)
        ends = accumulate(term.size for term in self.terms)
        for term, end in zip(self.terms, ends, strict=True):
            if term.name == name:
                return slice(end - term.size, end)
        raise AssertionError(name)

    def only(self, names: Sequence[str]) -> Self:
        """Return the layout of some of the parts, in the order of this one.

        Raises:
            KeyError: If there is none of a name.
        """
        chosen = {self.term(name).name for name in names}
        return type(self)(terms=tuple(term for term in self.terms if term.name in chosen))

    def columns(self, names: Sequence[str]) -> NDArray[np.intp]:
        """Return where some of the parts stand in the vector, in the order of this layout.

        Raises:
            KeyError: If there is none of a name.
        """
        terms = self.only(names).terms
        return np.concatenate([np.arange(self.size)[self.slice_of(term.name)] for term in terms])

    def vector(self, parts: Mapping[str, Any]) -> NDArray[np.float32]:
        """Return observations as vectors.

        Args:
            parts: Values by name, shape (..., *term.shape), with the same leading shape.

        Returns:
            Vectors, float32, shape (..., size).

        Raises:
            ValueError: If a part is missing, unknown or of another shape.
        """
        names = [term.name for term in self.terms]
        if set(parts) != set(names):
            raise ValueError(f"observation: expected parts {names}, got {sorted(parts)}")
        columns = []
        for term in self.terms:
            values = np.asarray(parts[term.name], dtype=np.float32)
            lead = values.shape[: values.ndim - len(term.shape)]
            if values.shape != (*lead, *term.shape):
                raise ValueError(
                    f"{term.name}: expected shape (..., {', '.join(map(str, term.shape))}), "
                    f"got {values.shape}"
                )
            columns.append(values.reshape(*lead, term.size))
        return np.concatenate(columns, axis=-1)

    def bounds(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the lowest and the highest vector, float32, rounded outward, shape (size,)."""
        low = [np.full(term.size, _outward(term.low, -np.inf)) for term in self.terms]
        high = [np.full(term.size, _outward(term.high, np.inf)) for term in self.terms]
        return np.concatenate(low), np.concatenate(high)

    def scale(self) -> NDArray[np.float32]:
        """Return the numbers a, b, c, d of the networks' input, float32, shape (4, size).

        ``(a + b x) / (c + d x)`` takes an observation ``x`` into -1 to 1.
        """
        columns = []
        for term in self.terms:
            row = (0.0, 1 / term.high, 1.0, 0.0)
            if term.scaling == "proximity":
                row = (MIDDLE_RANGE, -1.0, MIDDLE_RANGE, 1.0)
            elif term.scaling == "none":
                row = (0.0, 1.0, 1.0, 0.0)
            columns.append(np.repeat(np.array(row)[:, None], term.size, axis=1))
        return np.hstack(columns).astype(np.float32)


class ActionSpec(BaseModel):
    """Named actions with their bounds.

    Networks and environments deal in shares from -1 to 1; robots in SI units.

    Attributes:
        names: Names in their order, e.g. ``angular`` or ``linear``, the parts of a twist.
        low: Lowest value of each.
        high: Highest value of each.
        units: SI unit of each.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    names: tuple[str, ...] = Field(min_length=1)
    low: tuple[float, ...]
    high: tuple[float, ...]
    units: tuple[str, ...]

    @model_validator(mode="after")
    def _check_lengths(self) -> Self:
        if not len(self.names) == len(self.low) == len(self.high) == len(self.units):
            raise ValueError("actions: expected as many bounds and units as names")
        if not all(low < high for low, high in zip(self.low, self.high, strict=True)):
            raise ValueError(f"actions: expected low < high, got {self.low} and {self.high}")
        return self

    @property
    def size(self) -> int:
        """Number of actions."""
        return len(self.names)

    def scaled(self, shares: ArrayLike) -> NDArray[np.float64]:
        """Return actions in SI units for shares from -1 to 1, shape (..., size)."""
        middle, half = _span(self.low, self.high)
        return np.asarray(middle + half * np.asarray(shares, np.float64))


@lru_cache(maxsize=64)
def _span(
    low: tuple[float, ...], high: tuple[float, ...]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the middle of each pair of bounds, and half the distance between them."""
    least, most = np.array(low), np.array(high)
    return (least + most) / 2, (most - least) / 2


def _outward(bound: float, away: float) -> np.float32:
    """Return a bound as float32, moved outward where it is no float32: pi in float64 rounds up."""
    single = np.float32(bound)
    return single if float(single) == bound else np.nextafter(single, np.float32(away))


def steering_observations(n_sectors: int, max_range: float, limit: float) -> ObservationSpec:
    """Return the paper's state: ranges, the two previous actions, the heading error (section 4.1).

    Args:
        n_sectors: Number of ranges of the virtual scan (paper: 32).
        max_range: Largest range [m] (paper: 10).
        limit: Largest yaw rate [rad/s] (paper: 0.5).
    """
    return ObservationSpec(
        terms=(
            ObservationTerm(
                name="ranges",
                shape=(n_sectors,),
                low=0.0,
                high=max_range,
                unit="m",
                scaling="proximity",
            ),
            ObservationTerm(
                name="previous_actions", shape=(2,), low=-limit, high=limit, unit="rad/s"
            ),
            ObservationTerm(name="heading_error", shape=(1,), low=-np.pi, high=np.pi, unit="rad"),
        )
    )


def steering_points(n_sectors: int, max_range: float, limit: float) -> ObservationSpec:
    """Return the paper's state with the ranges as points, too, for policies that read a set.

    Point i is (sin a / d, cos a / d) with the bearing a and the range d of sector i [1/m], as in
    Zhang et al. (arXiv 2010.10209, section III-A); sectors that saw nothing are masked.

    Args:
        n_sectors: Number of ranges of the virtual scan.
        max_range: Largest range [m].
        limit: Largest yaw rate [rad/s].
    """
    near = 1 / MIN_POINT_RANGE
    points = (
        ObservationTerm(
            name="points", shape=(n_sectors, 2), low=-near, high=near, unit="1/m", scaling="none"
        ),
        ObservationTerm(
            name="mask", shape=(n_sectors,), low=0.0, high=1.0, unit="1", scaling="none"
        ),
    )
    return ObservationSpec(terms=points + steering_observations(n_sectors, max_range, limit).terms)


def points_of(ranges: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the ranges of sectors as points and their mask, shapes (..., n, 2) and (..., n).

    Args:
        ranges: Range of each sector, sector 0 centred on ``-pi + pi / n``, then counter-clockwise;
            NaN where nothing is known [m], shape (..., n).
    """
    count = ranges.shape[-1]
    bearings = -np.pi + 2 * np.pi / count * (np.arange(count) + 0.5)
    known = np.isfinite(ranges)
    near = np.where(known, 1 / np.maximum(np.where(known, ranges, 1.0), MIN_POINT_RANGE), 0.0)
    points = near[..., None] * np.stack([np.sin(bearings), np.cos(bearings)], axis=-1)
    return points.astype(np.float32), known.astype(np.float32)


def steering_actions(limit: float) -> ActionSpec:
    """Return the paper's one action: a yaw rate within +-``limit`` [rad/s]."""
    return ActionSpec(names=("angular",), low=(-limit,), high=(limit,), units=("rad/s",))
