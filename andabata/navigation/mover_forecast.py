"""Where movers will be, and what it costs to be near them at that time.

Movers are expected to go on at constant velocity, and where they are becomes less sure with time.
Rollouts off-road pay for each of their points by its own time; the shield of robots in rooms asks
for contacts by the same law.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.navigation.mover_tracks import TrackedMovers
from terrain.kernel import borrowing_kernel, kernel

_LEAST = 1e-6
"""Least distance that is kept from a mover, so that shares of it are numbers [m]."""


class MoverForecastConfig(BaseModel):
    """Settings of the forecast, all of them assumptions.

    Attributes:
        doubt_share: Share of a track's doubt that counts: its gate is wider than its errors.
        doubt_growth: Speed by which the doubt grows: people turn, stop and step aside [m/s].
        max_doubt: Largest doubt [m].
        margin: Distance that is kept beside the doubt [m].
        headway: Time for which the way before a mover counts as its own: nobody crosses close
            before it [s].
        contact_cost: Cost of a second in contact, if the place were sure [m/s].
        sure_doubt: Doubt up to which a place is sure; beyond it costs fall as the doubt grows [m].
        max_speed: Speed above which a track is not believed [m/s]: it has joined two movers.
        max_movers: Number of movers that count, those that can be at the robot first.
        reach_time: Time within which a mover has to be able to reach the robot to count [s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    doubt_share: float = Field(default=0.4, ge=0)
    doubt_growth: float = Field(default=0.12, ge=0)
    max_doubt: float = Field(default=1.0, gt=0)
    margin: float = Field(default=0.15, ge=0)
    headway: float = Field(default=0.6, ge=0)
    contact_cost: float = Field(default=25.0, ge=0)
    sure_doubt: float = Field(default=0.4, gt=0)
    max_speed: float = Field(default=4.0, gt=0)
    max_movers: int = Field(default=16, ge=1)
    reach_time: float = Field(default=7.0, gt=0)


class MoverForecast(NamedTuple):
    """Movers as kernels read them, and the numbers of the settings.

    Attributes:
        places: Centres now [m], shape (k, 2).
        velocities: Velocities [m/s], shape (k, 2).
        radii: Radii [m], shape (k,).
        doubts: Distances from the centres within which they are now [m], shape (k,).
        growth: Speed by which these grow [m/s].
        max_doubt: Largest doubt [m].
        margin: Distance that is kept beside the doubt [m].
        headway: Time for which the way before a mover counts as its own [s].
        contact_cost: Cost of a second in contact, if the place were sure [m/s].
        sure_doubt: Doubt up to which a place is sure [m].
    """

    places: NDArray[np.float64]
    velocities: NDArray[np.float64]
    radii: NDArray[np.float64]
    doubts: NDArray[np.float64]
    growth: float
    max_doubt: float
    margin: float
    headway: float
    contact_cost: float
    sure_doubt: float


def forecast_of(
    movers: TrackedMovers,
    config: MoverForecastConfig,
    position: NDArray[np.float64],
    speed: float,
    origin: NDArray[np.float64] | None = None,
) -> MoverForecast:
    """Return the movers that can reach a robot in time, the first ones first.

    Tracks that are not finite, or faster than ``max_speed``, are left out; of the others at most
    ``max_movers`` count, so that the cost of a decision is bounded.

    Args:
        movers: Tracks.
        config: Settings.
        position: Position of the robot in the frame of the tracks [m], shape (2,).
        speed: Largest speed of the robot [m/s].
        origin: Place from which the forecast's places count [m], shape (2,); None for that of the
            tracks.
    """
    speeds = np.hypot(*movers.velocities.T)
    numbers = (movers.places, movers.velocities, movers.radii[:, None], movers.doubts[:, None])
    is_finite = np.isfinite(np.hstack(numbers)).all(axis=1)
    is_believed = is_finite & (speeds <= config.max_speed)
    gaps = np.hypot(*(movers.places - position).T) - movers.radii
    times = np.where(is_believed, gaps / (speeds + speed), np.inf)
    first = np.argsort(times, kind="stable")[: config.max_movers]
    chosen = first[times[first] < config.reach_time]
    places = movers.places[chosen] - (0.0 if origin is None else origin)
    return MoverForecast(
        np.ascontiguousarray(places, dtype=np.float64),
        np.ascontiguousarray(movers.velocities[chosen], dtype=np.float64),
        np.ascontiguousarray(movers.radii[chosen], dtype=np.float64),
        config.doubt_share * movers.doubts[chosen],
        config.doubt_growth,
        config.max_doubt,
        config.margin,
        config.headway,
        config.contact_cost,
        config.sure_doubt,
    )


NO_MOVERS = forecast_of(TrackedMovers.none(), MoverForecastConfig(), np.zeros(2), 0.0)
"""Forecast of nothing that moves."""


@borrowing_kernel
def mover_offset(
    places: NDArray[np.float64],
    velocities: NDArray[np.float64],
    m: int,
    time: float,
    x: float,
    y: float,
) -> tuple[float, float]:
    """Return where a mover is expected after a time, from a place [m].

    Args:
        places: Centres now [m], shape (k, 2).
        velocities: Velocities [m/s], shape (k, 2).
        m: Number of the mover.
        time: Time from now [s].
        x: Place [m].
        y: Place [m].
    """
    return places[m, 0] + time * velocities[m, 0] - x, places[m, 1] + time * velocities[m, 1] - y


@kernel
def mover_price(
    x: float, y: float, ahead: tuple[float, float], radius: float, time: float, near: MoverForecast
) -> float:
    """Return the cost of a second near the movers at a time [m/s].

    It is largest in contact and falls with the square of the gap's share of doubt and margin.

    Args:
        x: Middle of the robot [m].
        y: Middle of the robot [m].
        ahead: Middle of the circle before it, from the middle [m]; another lies behind it.
        radius: Radius of the two circles [m].
        time: Time from now [s].
        near: Movers.
    """
    price = 0.0
    for m in range(len(near.radii)):
        dx, dy = mover_offset(near.places, near.velocities, m, time, x, y)
        vx, vy = near.velocities[m, 0], near.velocities[m, 1]
        doubt = min(near.doubts[m] + near.growth * time, near.max_doubt)
        kept, body = near.margin + doubt, near.radii[m] + radius
        farthest = kept + body + np.hypot(*ahead) + near.headway * np.hypot(vx, vy)
        if dx * dx + dy * dy >= farthest * farthest:
            continue
        away = np.inf
        for side in (-1.0, 1.0):
            # The way before the mover belongs to it for a while.
            u, v = dx - side * ahead[0], dy - side * ahead[1]
            square = vx * vx + vy * vy
            share = -(u * vx + v * vy) / square if square > 0.0 else 0.0
            until = min(max(share, 0.0), near.headway)
            away = min(away, np.hypot(u + until * vx, v + until * vy))
        if away < body + kept:
            share = 1.0 - max(away - body, 0.0) / max(kept, _LEAST)
            price += share * share * min(near.sure_doubt / doubt, 1.0)
    return near.contact_cost * price
