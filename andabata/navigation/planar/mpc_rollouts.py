"""Compiled rollouts of the sampling MPC: command sequences, the motion that follows, its cost.

Costs are times: the time to the goal from where a sequence ends, and what margins, contacts and
turns cost on the way.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.planar.footprint import Corners, reach_of
from andabata.navigation.mover_forecast import NO_MOVERS, MoverForecast, mover_price
from andabata.navigation.planar.dynamics import (
    MotionState,
    PlanarDynamics,
    WheelLimits,
    advance_axis,
    axis_step,
    delayed,
    limited,
)
from andabata.navigation.planar.nearest_hits import NearestHits
from andabata.navigation.planar.time_to_go import TimeField, time_at
from terrain.kernel import inlined_kernel, kernel


class Delayed(NamedTuple):
    """Dynamics, and the commands that have no effect yet.

    Attributes:
        past: Commands given before, the oldest first, one or more, shape (p, 2).
        dynamics: Delay, lag and accelerations.
        period: Control period [s].
    """

    past: NDArray[np.float64]
    dynamics: PlanarDynamics
    period: float


class Body(NamedTuple):
    """Footprint of the robot.

    Attributes:
        inner: Places in it at which nearest hits are looked up, the middle first [m], shape
            (1 + c, 2).
        sides: Outward normal of each side of its convex outline, the distance of the side's line
            from the middle, and where along it the side begins and ends [m], shape (c, 5).
        reach: Distance of the farthest corner from the middle [m].
    """

    inner: NDArray[np.float64]
    sides: NDArray[np.float64]
    reach: float


_INNER = 0.55
"""Share of the way from the middle to each corner of the footprint, at which the nearest hit is
looked up: near enough to corner and sides that no other hit is nearer to them."""


_NEARER = 0.005
"""Distance by which a robot in contact has to come nearer for another contact [m]."""


def body_of(footprint: Corners) -> Body:
    """Return a footprint as kernels read it."""
    corners = np.array(footprint, dtype=np.float64)
    along = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.hypot(*along.T)[:, None]
    distances = (normals * corners).sum(axis=1)
    begins = normals[:, 0] * corners[:, 1] - normals[:, 1] * corners[:, 0]
    sides = np.column_stack([normals, distances, begins, begins + np.hypot(*along.T)])
    inner = np.vstack([np.zeros(2), _INNER * corners])
    return Body(inner, sides, reach_of(footprint))


class Prices(NamedTuple):
    """Costs of a rollout; see ``SamplingMpcConfig``.

    Attributes:
        margin: Margin of a robot that hardly moves [m].
        margin_per_speed: Further margin per speed [s].
        margin_cost: Cost of a second without any distance.
        contact_distance: Distance to a hit that counts as contact [m].
        contact_cost: Cost of a contact [s].
        reverse_cost: Cost of a metre backwards [s/m].
        turn_cost: Cost of changes of the yaw rate [s3/rad2].
        arrival_radius: Distance from the goal at which the robot has arrived [m].
    """

    margin: float
    margin_per_speed: float
    margin_cost: float
    contact_distance: float
    contact_cost: float
    reverse_cost: float
    turn_cost: float
    arrival_radius: float


class KnownSurroundings(NamedTuple):
    """What the robot knows around it.

    Attributes:
        hits: Nearest hits.
        field: Time to the goal.
        goal_x: Goal [m].
        goal_y: Goal [m].
        movers: Movers, and what it costs to be near them; without any nothing is priced.
    """

    hits: NearestHits
    field: TimeField
    goal_x: float
    goal_y: float
    movers: MoverForecast = NO_MOVERS


@kernel
def draw_commands(
    plan: NDArray[np.float64],
    fixed: NDArray[np.float64],
    noise: NDArray[np.float64],
    limits: WheelLimits,
    commands: NDArray[np.float64],
) -> None:
    """Write the sequences of a tick: the last plan, fixed ones, and noise around the plan.

    Args:
        plan: Commands of the last plan, shape (steps, 2).
        fixed: Sequences that do not depend on the plan, shape (k, steps, 2).
        noise: Deviations at the knots, shape (drawn, knots, 2).
        limits: Limits of commands.
        commands: Result, shape (1 + k + drawn, steps, 2).
    """
    steps, knots, first = len(plan), noise.shape[1], 1 + len(fixed)
    commands[0] = plan
    commands[1:first] = fixed
    for s in range(len(noise)):
        # A third varies little around the plan, to refine it.
        scale = 0.3 if s % 3 == 0 else 1.0
        for t in range(steps):
            along = t * (knots - 1) / (steps - 1)
            k = min(int(along), knots - 2)
            share = along - k
            v = noise[s, k, 0] + share * (noise[s, k + 1, 0] - noise[s, k, 0])
            w = noise[s, k, 1] + share * (noise[s, k + 1, 1] - noise[s, k, 1])
            v, w = limited(plan[t, 0] + scale * v, plan[t, 1] + scale * w, limits)
            commands[first + s, t, 0], commands[first + s, t, 1] = v, w


@kernel
def mean_commands(
    commands: NDArray[np.float64], costs: NDArray[np.float64], temperature: float
) -> NDArray[np.float64]:
    """Return the mean of sequences, weighted by what they cost, shape (steps, 2)."""
    mean = np.zeros(commands.shape[1:])
    least, total = np.min(costs), 0.0
    for s in range(len(costs)):
        weight = np.exp((least - costs[s]) / temperature)
        # Most weigh nothing.
        if weight > 1e-4:
            total += weight
            mean += weight * commands[s]
    return mean / total


@kernel
def before_effect(start: MotionState, late: Delayed) -> MotionState:
    """Return the motion when the first new command begins to have its full effect."""
    dynamics, period = late.dynamics, late.period
    step_v = axis_step(dynamics.acceleration, dynamics.lag, period)
    step_w = axis_step(dynamics.yaw_acceleration, dynamics.lag, period)
    x, y, yaw, v, w, set_v, set_w = start
    # A part of a period's delay is left to the rollouts, which mix commands.
    delay, whole = dynamics.delay / period, int(dynamics.delay / period)
    for k in range(whole):
        at = len(late.past) + k
        set_v, new_v = advance_axis(set_v, v, delayed(late.past, at, 0, delay), step_v)
        set_w, new_w = advance_axis(set_w, w, delayed(late.past, at, 1, delay), step_w)
        middle = yaw + 0.25 * (w + new_w) * period
        way = 0.5 * (v + new_v) * period
        x, y = x + way * np.cos(middle), y + way * np.sin(middle)
        yaw += 0.5 * (w + new_w) * period
        v, w = new_v, new_w
    return MotionState(x, y, yaw, v, w, set_v, set_w)


@kernel
def price_all(
    commands: NDArray[np.float64],
    start: MotionState,
    late: Delayed,
    around: KnownSurroundings,
    body: Body,
    prices: Prices,
    costs: NDArray[np.float64],
) -> None:
    """Write the cost of each sequence [s].

    Args:
        commands: Sequences, shape (samples, steps, 2).
        start: Motion when their first commands begin to have effect.
        late: Dynamics, and the commands before.
        around: Hits and time to the goal.
        body: Footprint.
        prices: Costs.
        costs: Result, shape (samples,).
    """
    # Noise of ranges brings hits into the robot's own outline. Where it stands is no contact: else
    # all sequences would end at once and cost the same, those that lead away, too.
    cosine, sine = np.cos(start.yaw), np.sin(start.yaw)
    margin = max(prices.margin, prices.contact_distance)
    free = _free_distance(start.x, start.y, cosine, sine, around.hits, body, margin)
    contact = min(prices.contact_distance, free - _NEARER)
    for s in range(len(commands)):
        costs[s] = _price(commands[s], start, late, around, body, prices, contact)


@kernel
def _price(
    commands: NDArray[np.float64],
    start: MotionState,
    late: Delayed,
    around: KnownSurroundings,
    body: Body,
    prices: Prices,
    contact: float,
) -> float:
    """Return the cost of a sequence [s], which ends below a distance that is contact [m]."""
    dynamics, period = late.dynamics, late.period
    step_v = axis_step(dynamics.acceleration, dynamics.lag, period)
    step_w = axis_step(dynamics.yaw_acceleration, dynamics.lag, period)
    x, y, yaw, v, w, set_v, set_w = start
    cosine, sine = np.cos(yaw), np.sin(yaw)
    # In each period a part of the command before is still in effect.
    old = dynamics.delay / period - int(dynamics.delay / period)
    last_v, last_w = late.past[-1]
    steps, cost = len(commands), 0.0
    # Movers are where they are now, commands have effect after the delay.
    waited, moves = int(dynamics.delay / period), len(around.movers.radii) > 0
    for t in range(steps):
        now_v, now_w = commands[t, 0], commands[t, 1]
        set_v, new_v = advance_axis(set_v, v, now_v + old * (last_v - now_v), step_v)
        set_w, new_w = advance_axis(set_w, w, now_w + old * (last_w - now_w), step_w)
        cost += prices.turn_cost * (now_w - last_w) ** 2 / period
        last_v, last_w = now_v, now_w
        # The way of a period leads along the mean of the headings at its ends.
        way, turn = 0.25 * (v + new_v) * period, 0.5 * (w + new_w) * period
        x, y = x + way * cosine, y + way * sine
        cosine, sine = _turned(cosine, sine, turn)
        x, y = x + way * cosine, y + way * sine
        v, w = new_v, new_w
        cost += prices.reverse_cost * max(-v, 0.0) * period
        # Contact counts without any margin, too.
        margin = max(prices.margin + prices.margin_per_speed * abs(v), prices.contact_distance)
        free = _free_distance(x, y, cosine, sine, around.hits, body, margin)
        if free < contact:
            # The later the contact, the more time to find another way.
            return cost + prices.contact_cost * (2.0 - t / steps)
        if free < margin:
            cost += prices.margin_cost * period * (1.0 - free / margin) ** 2
        if moves:
            time = (waited + t + 1) * period
            price = mover_price(x, y, (0.0, 0.0), body.reach, time, around.movers)
            cost += price * period
        squared = (x - around.goal_x) ** 2 + (y - around.goal_y) ** 2
        if squared < prices.arrival_radius**2:
            return cost - (steps - 1 - t) * period
    return cost + time_at(around.field, x, y)


@kernel
def _turned(cosine: float, sine: float, turn: float) -> tuple[float, float]:
    """Return cosine and sine of a heading after a small turn, whose own are series (1e-6 at 0.4).

    Rollouts turn by little in a period: this is several times faster than the library's functions.
    """
    squared = turn * turn
    c = 1.0 - squared * (0.5 - squared * (1.0 / 24.0 - squared / 720.0))
    s = turn * (1.0 - squared * (1.0 / 6.0 - squared * (1.0 / 120.0 - squared / 5040.0)))
    return cosine * c - sine * s, sine * c + cosine * s


@inlined_kernel
def _free_distance(
    x: float,
    y: float,
    cosine: float,
    sine: float,
    hits: NearestHits,
    body: Body,
    margin: float,
) -> float:
    """Return the distance of the footprint from the nearest hit [m], or anything above a margin.

    The hit nearest to each inner place is the nearest to the outline beside that place, or hardly
    farther; its distance from the outline is exact. Calls here would cost as much as the work: the
    arrays that they pass are counted.
    """
    places, inner, sides = hits.places, body.inner, body.sides
    n, scale = len(places), hits.per_metre
    u, v = (x - hits.corner[0]) * scale, (y - hits.corner[1]) * scale
    within = (body.reach + margin) ** 2
    nearest, last_dx, last_dy = margin + 1.0, np.inf, np.inf
    for k in range(len(inner)):
        a, b = inner[k, 0] * scale, inner[k, 1] * scale
        p, q = u + cosine * a - sine * b, v + sine * a + cosine * b
        # Beyond the square there is nothing.
        if not (0.0 <= p < n and 0.0 <= q < n):
            continue
        dx, dy = places[int(p), int(q), 0] - x, places[int(p), int(q), 1] - y
        if dx * dx + dy * dy > within:
            # If the hit nearest to the middle is too far, all are.
            if k == 0:
                break
            continue
        # Neighbouring places often share their hit.
        if dx == last_dx and dy == last_dy:
            continue
        last_dx, last_dy = dx, dy
        # The nearest place of a convex outline is on the side whose line lies farthest inwards.
        ahead, left = cosine * dx + sine * dy, cosine * dy - sine * dx
        beyond, side = -np.inf, 0
        for c in range(len(sides)):
            distance = sides[c, 0] * ahead + sides[c, 1] * left - sides[c, 2]
            if distance > beyond:
                beyond, side = distance, c
        # Most hits are farther than the nearest from that line alone, without a root.
        if beyond < nearest:
            along = sides[side, 0] * left - sides[side, 1] * ahead
            past = max(sides[side, 3] - along, along - sides[side, 4], 0.0)
            nearest = min(nearest, np.sqrt(max(beyond, 0.0) ** 2 + past * past))
    return nearest
