"""Sampling MPC: rolls out many command sequences and returns the first command of their best mean.

Model predictive path integral control (Williams et al. 2017): sequences are drawn around the last
plan, each is driven ahead with the robot's dynamics, and the mean of all, weighted by what they
cost, is the new plan. A mean of ways left and right of a post leads into it, so that the mean
counts only if it costs no more than the best of its sequences.
"""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.kinematics import Twist
from andabata.machine.planar.footprint import Corners
from andabata.navigation.mover_forecast import NO_MOVERS, MoverForecast
from andabata.navigation.planar.dynamics import (
    MotionState,
    PlanarDynamics,
    WheelLimits,
    limited,
)
from andabata.navigation.planar.mpc_rollouts import (
    Delayed,
    KnownSurroundings,
    Prices,
    before_effect,
    body_of,
    draw_commands,
    mean_commands,
    price_all,
)
from andabata.navigation.planar.nearest_hits import NearestHits
from andabata.navigation.planar.time_to_go import MarginConfig, TimeField


class SamplingMpcConfig(BaseModel):
    """Settings of the controller.

    Attributes:
        samples: Number of command sequences.
        horizon: Time that each is driven ahead, once its first command has effect [s].
        knots: Number of draws along a sequence; commands between them are interpolated.
        speed_noise: Standard deviation of the speeds drawn [m/s].
        yaw_noise: Standard deviation of the yaw rates drawn [rad/s].
        arc_speeds: Speeds of the constant arcs among the sequences, as shares of the largest.
        arc_yaw_rates: Yaw rates of the constant arcs [rad/s].
        turn_times: Times of turns on the spot after which the robot drives straight ahead [s]: no
            constant command leads out where the way leads back.
        turn_rate: Yaw rate of these turns [rad/s].
        turn_speed: Speed behind them [m/s].
        temperature: Cost by which a sequence loses all but 37 % of its weight [s].
        margin: Distance to obstacles that the robot keeps where it can.
        margin_cost: Cost of a second without any distance.
        contact_distance: Distance to a hit that counts as contact [m].
        contact_cost: Cost of a contact [s].
        reverse_cost: Cost of a metre backwards [s/m]: the laser sees nothing behind, and the time
            to the goal knows no heading.
        turn_cost: Cost of changes of the yaw rate [s3/rad2].
        arrival_radius: Distance from the goal at which the robot has arrived [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    samples: int = Field(default=300, ge=100)
    horizon: float = Field(default=2.0, gt=0)
    knots: int = Field(default=6, ge=2)
    speed_noise: float = Field(default=0.5, gt=0)
    yaw_noise: float = Field(default=1.2, gt=0)
    arc_speeds: tuple[float, ...] = (0.25, 0.5, 0.75, 1.0)
    arc_yaw_rates: tuple[float, ...] = (-3.0, -2.0, -1.2, -0.6, 0.0, 0.6, 1.2, 2.0, 3.0)
    turn_times: tuple[float, ...] = (0.3, 0.6, 0.9, 1.2)
    turn_rate: float = Field(default=3.0, gt=0)
    turn_speed: float = Field(default=1.0, gt=0)
    temperature: float = Field(default=0.03, gt=0)
    margin: MarginConfig = MarginConfig()
    margin_cost: float = Field(default=6.0, ge=0)
    contact_distance: float = Field(default=0.02, ge=0)
    contact_cost: float = Field(default=100.0, gt=0)
    reverse_cost: float = Field(default=3.0, ge=0)
    turn_cost: float = Field(default=0.002, ge=0)
    arrival_radius: float = Field(default=0.3, gt=0)


class SamplingMpc:
    """Selects commands by driving many sequences of them ahead.

    Attributes:
        config: Settings.
        plan: Commands of the last plan, from now on: speed [m/s] and yaw rate [rad/s], shape
            (steps, 2).
        costs: Costs of the sequences of the last tick [s], shape (samples,).
    """

    def __init__(
        self,
        config: SamplingMpcConfig,
        limits: WheelLimits,
        footprint: Corners,
        period: float,
    ) -> None:
        """Prepare for a robot.

        Args:
            config: Settings.
            limits: Limits of its commands.
            footprint: Corners of its convex outline, counter-clockwise [m].
            period: Control period [s].

        Raises:
            ValueError: If the fixed sequences leave too few samples to draw.
        """
        self.config, self._limits, self._period = config, limits, period
        steps = round(config.horizon / period)
        self._fixed = _fixed_sequences(config, limits, steps, period)
        drawn = config.samples - 1 - len(self._fixed)
        if drawn < 50:
            raise ValueError(
                f"samples: expected at least 50 more than the {len(self._fixed)} fixed "
                f"sequences, got {config.samples}; raise samples or take fewer arcs"
            )
        self._body = body_of(footprint)
        self.plan = np.zeros((steps, 2))
        self.costs = np.zeros(config.samples)
        self._commands = np.zeros((config.samples, steps, 2))
        self._noise = (drawn, config.knots, 2)

    def reset(self) -> None:
        """Forget the last plan."""
        self.plan[:] = 0.0

    def command(
        self,
        state: MotionState,
        past: NDArray[np.float64],
        dynamics: PlanarDynamics,
        hits: NearestHits,
        field: TimeField,
        goal: NDArray[np.float64],
        rng: np.random.Generator,
        risk: float = 0.0,
        backing: float = 0.0,
        movers: MoverForecast = NO_MOVERS,
    ) -> Twist:
        """Return the command of this period.

        Args:
            state: Motion now.
            past: Commands given before, the oldest first, at least as many as the delay holds,
                shape (p, 2).
            dynamics: Delay, lag and accelerations.
            hits: Nearest hits.
            field: Time to the goal.
            goal: Goal [m], shape (2,).
            rng: Source of randomness.
            risk: Share of the margin that is given up, with as much more noise, for a robot that
                is stuck.
            backing: Share of the cost of ways backwards that is given up.
            movers: Movers, and what it costs to be near them.
        """
        config = self.config
        # The last plan, one period later; its end goes on.
        self.plan[:-1] = self.plan[1:].copy()
        noise = rng.standard_normal(self._noise)
        noise[..., 0] *= config.speed_noise * (1.0 + risk)
        noise[..., 1] *= config.yaw_noise * (1.0 + risk)
        draw_commands(self.plan, self._fixed, noise, self._limits, self._commands)
        # What was commanded before and has no effect yet is driven in any case.
        late = Delayed(past, dynamics, self._period)
        start = before_effect(state, late)
        prices = Prices(
            margin=config.margin.standing * (1.0 - risk),
            margin_per_speed=config.margin.per_speed * (1.0 - risk),
            margin_cost=config.margin_cost,
            contact_distance=config.contact_distance,
            contact_cost=config.contact_cost,
            reverse_cost=config.reverse_cost * (1.0 - backing),
            turn_cost=config.turn_cost,
            arrival_radius=config.arrival_radius,
        )
        around = KnownSurroundings(hits, field, float(goal[0]), float(goal[1]), movers)
        price_all(self._commands, start, late, around, self._body, prices, self.costs)
        self.plan[:] = self._best(start, late, around, prices)
        return Twist(float(self.plan[0, 0]), float(self.plan[0, 1]))

    def _best(
        self, start: MotionState, late: Delayed, around: KnownSurroundings, prices: Prices
    ) -> NDArray[np.float64]:
        """Return the weighted mean of the sequences, or the best of them if it is cheaper."""
        best = int(np.argmin(self.costs))
        mean = mean_commands(self._commands, self.costs, self.config.temperature)
        own = np.zeros(1)
        price_all(mean[None], start, late, around, self._body, prices, own)
        is_good = own[0] <= self.costs[best] + self.config.temperature
        return mean if is_good else self._commands[best]


def _fixed_sequences(
    config: SamplingMpcConfig, limits: WheelLimits, steps: int, period: float
) -> NDArray[np.float64]:
    """Return the sequences of every tick, shape (k, steps, 2).

    They are constant arcs, turns on the spot, ways backwards and standing; and turns on the spot
    before ways straight ahead.
    """
    constant = [
        (share * limits.max_speed, rate)
        for share in config.arc_speeds
        for rate in config.arc_yaw_rates
    ]
    constant += [(0.0, -2.0), (0.0, -1.0), (0.0, 1.0), (0.0, 2.0), (0.0, 0.0)]
    constant += [(limits.min_speed, rate) for rate in (-1.0, 0.0, 1.0)]
    arcs = [np.tile(limited(v, w, limits), (steps, 1)) for v, w in constant]
    turns = []
    times = period * np.arange(1, steps + 1)
    for time in config.turn_times:
        # The turn begins and ends gradually: sudden changes of the yaw rate cost more than it.
        share = np.clip(np.minimum(times, time + period - times) / _RAMP, 0.0, 1.0)
        for rate in (-config.turn_rate, config.turn_rate):
            speed = np.where(times > time, config.turn_speed, 0.0)
            pairs = zip(speed.tolist(), (rate * share).tolist(), strict=True)
            turns.append(np.array([limited(v, w, limits) for v, w in pairs]))
    return np.array(arcs + turns)


_RAMP = 0.2
"""Time in which turns on the spot reach their yaw rate, and end [s]."""
