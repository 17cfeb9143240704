"""Forward-simulates candidate arcs and turns on the local plan and selects a safe command.

The robot turns only so sharply: of the ways that a plan shows it can take those that begin with an
arc it can drive (the dynamic window, Fox et al. 1997, at constant speed; three arcs in a row are an
assumption). Where none leads on it turns on the spot or backs out, as a skid-steer can and the
paper's never does; over ground that is known to be free it drives faster. Near what moves it can
stand still, too, and each speed has its price: faster may be into somebody, or out of the way.
"""

import math
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.clock import CONTROL_PERIOD
from andabata.machine.kinematics import Twist, executed_twist
from andabata.machine.robot import RobotModel
from andabata.navigation.arrival import ARRIVAL_DISTANCE
from andabata.navigation.mover_forecast import MoverForecast, MoverForecastConfig, forecast_of
from andabata.navigation.mover_tracks import TrackedMovers
from andabata.navigation.planning.grid_planner import GridPlanner
from andabata.navigation.planning.rollout_inputs import (
    BodyCircles,
    Candidates,
    Place,
    PlannedGround,
    RolloutMotion,
    Stops,
)
from andabata.navigation.planning.rollout_prices import STEP, is_clear, price_moves
from andabata.navigation.planning.speed_limit import SpeedLimit, is_free
from terrain.kernel import kernel

_STAY_RADIUS = 2.5
"""Distance within which the robot counts as staying about a place [m]."""

_STAY_MEMORY = 90.0
"""Time after which a stay is forgotten [s]."""


class TrajectoryRolloutsConfig(BaseModel):
    """Settings of the rollouts.

    Attributes:
        arc_time: Duration of an arc [s].
        arcs: Number of arcs in a row; their number and time make the horizon.
        rates: Yaw rates of an arc, as shares of the steering limit.
        margin: Clearance that is kept around the body [m].
        no_progress_time: Time about one place after which the robot begins to keep less clearance;
            after twice as long it keeps ``clearance_relaxation`` less [s]. By then nothing allowed
            leads on, and obstacles are whole cells: the gaps between them are wider than they look.
        clearance_relaxation: Clearance that is given up then [m].
        cost_share: Share of the plan's extra costs of a metre that counts.
        action_repeat: Number of control steps between two decisions, as in training.
        turns: Number of turns on the spot to each side, up to half a one.
        stop_cost: Cost of each stop, to turn on the spot or to back out, beside its time [m].
        override_margin: Cost by which another way has to be cheaper than the controller's command
            to replace it [m].
        max_speed_scale: Largest share of the robot's speed, for arcs over ground that is known to
            be free with clearance on both sides, or where the robot came through; 1 is the paper's
            one speed.
        full_speed_clearance: Least clearance at which half of the extra speed is driven [m].
        max_speed_clearance: Least clearance at which all of it is driven [m]; None takes the plan's
            inflation radius.
        check_time: Time for which a command with a speed of its own must be clear for the body,
            without ``margin`` [s].
        patience: Time without coming nearer to the goal after which such commands are replaced in
            any case, until the robot does [s].
        movers: Forecast of what moves, and its prices; without tracks it changes nothing.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    arc_time: float = Field(default=2.2, gt=0)
    arcs: int = Field(default=3, ge=2, le=5)
    rates: tuple[float, ...] = (-1.0, -0.5, 0.0, 0.5, 1.0)
    margin: float = Field(default=0.06, ge=0)
    no_progress_time: float = Field(default=30.0, gt=0)
    clearance_relaxation: float = Field(default=0.2, ge=0)
    cost_share: float = Field(default=0.5, ge=0)
    action_repeat: int = Field(default=5, ge=1)
    turns: int = Field(default=6, ge=1)
    stop_cost: float = Field(default=3.0, ge=0)
    override_margin: float = Field(default=0.3, ge=0)
    max_speed_scale: float = Field(default=2.0, ge=1, le=3)
    full_speed_clearance: float = Field(default=0.9, gt=0)
    max_speed_clearance: float | None = Field(default=None, gt=0)
    check_time: float = Field(default=1.6, ge=0)
    patience: float = Field(default=25.0, gt=0)
    movers: MoverForecastConfig = Field(default_factory=MoverForecastConfig)


class _Situation(NamedTuple):
    """Where the robot is when it decides.

    Attributes:
        plan: Plan with costs to the goal.
        cell: Edge of its cells [m].
        place: Pose of the robot in the plan's square.
        body: Body of the robot, with the margin that it keeps now.
        near: Movers that can reach the robot.
        is_near: True if there are any.
    """

    plan: GridPlanner
    cell: float
    place: Place
    body: BodyCircles
    near: MoverForecast
    is_near: bool


class TrajectoryRollouts:
    """Selects the first move of the cheapest rollout over a plan."""

    def __init__(
        self,
        robot: RobotModel,
        config: TrajectoryRolloutsConfig,
        goal_radius: float = ARRIVAL_DISTANCE,
    ) -> None:
        """Prepare for a body.

        Args:
            robot: Size, speed and steering limit.
            config: Settings.
            goal_radius: Distance from the goal at which the robot stops, and rollouts end [m].
        """
        self.config, self._goal_radius = config, goal_radius
        self._robot = robot
        limit, arcs = robot.max_steering, config.arcs
        turns = np.arange(1, config.turns + 1) * np.pi / config.turns
        self._candidates = Candidates(
            rates=np.array([0.0, *config.rates]) * limit,
            scales=np.ones(1 + len(config.rates)),
            turns=np.concatenate([turns, -turns]),
            # What follows an arc backwards is a turn, which has its own price from there.
            reverse_rates=np.array([-0.5, 0.0, 0.5]) * limit,
            after_arc=np.ascontiguousarray(
                arc_fan(robot, config.rates, arcs - 1, config.arc_time)[0]
            ),
            after_turn=np.ascontiguousarray(
                arc_fan(robot, config.rates, arcs - 1, config.arc_time * arcs / (arcs - 1))[0]
            ),
        )
        self._motion = RolloutMotion(round(config.arc_time / STEP), robot.speed * STEP, STEP)
        self._body = BodyCircles(
            radius=robot.half_radius + config.margin,
            offset=robot.length / 4,
            swing_radius=math.hypot(robot.length / 2, robot.width / 2) + config.margin,
            cost_share=config.cost_share,
            turn_cost=robot.speed / limit,
            turn_rate=limit,
        )
        self._prices = np.zeros(_count_moves(self._candidates))
        self._nobody = forecast_of(TrackedMovers.none(), config.movers, np.zeros(2), robot.speed)
        decisions = round(_STAY_MEMORY / (config.action_repeat * CONTROL_PERIOD))
        self._places = np.empty((decisions, 2))
        self.reset()

    def reset(self) -> None:
        """Forget where the robot was, and that it was turning on the spot, or waiting."""
        self._turning, self._is_waiting = 0.0, False
        self._places[:] = np.inf
        self._decisions = 0

    def select(
        self,
        plan: GridPlanner,
        cell: float,
        position: NDArray[np.float64],
        yaw: float,
        rate: float,
        movers: TrackedMovers | None = None,
    ) -> Twist:
        """Return the controller's command, or the first move of a way that is cheaper.

        It is replaced by a way that is cheaper by more than ``override_margin``: an arc, a turn on
        the spot, or an arc backwards until one of these leads on; near movers also another speed,
        or standing still.

        Args:
            plan: Plan with costs to the goal.
            cell: Edge of its cells [m].
            position: Position of the robot in ``odom`` [m], shape (2,).
            yaw: Heading there [rad].
            rate: Yaw rate of the command [rad/s].
            movers: Tracks of what moves, in ``odom``; None for nothing.
        """
        at = self._situation(plan, cell, position, yaw, movers)
        return self._cheapest(at, rate)

    def check(
        self,
        plan: GridPlanner,
        cell: float,
        position: NDArray[np.float64],
        yaw: float,
        command: Twist,
        stalled_time: float,
        movers: TrackedMovers | None = None,
    ) -> Twist:
        """Return a command with a speed of its own, or the rollouts' choice where it is not clear.

        Args:
            plan: Plan with costs to the goal.
            cell: Edge of its cells [m].
            position: Position of the robot in ``odom`` [m], shape (2,).
            yaw: Heading there [rad].
            command: Command.
            stalled_time: Time without coming nearer to the goal [s].
            movers: Tracks of what moves, in ``odom``; None for nothing.
        """
        config = self.config
        at = self._situation(plan, cell, position, yaw, movers)
        bare = at.body._replace(
            radius=at.body.radius - config.margin, swing_radius=at.body.swing_radius - config.margin
        )
        twist = executed_twist(command, self._robot)
        moves = (twist.linear, twist.angular)
        is_own = stalled_time <= config.patience and not at.is_near
        if is_own and is_clear(self._ground(at), at.place, bare, moves, config.check_time):
            self._turning, self._is_waiting = 0.0, False
            return command
        return self._cheapest(at, command.angular)

    def _cheapest(self, at: _Situation, rate: float) -> Twist:
        """Return the command of a yaw rate [rad/s], or the first move of a way that is cheaper."""
        config, robot, moves = self.config, self._robot, self._candidates
        moves.rates[0] = executed_twist(Twist(robot.speed, rate), robot).angular
        if at.is_near:
            moves = self._with_speeds(at)
        prices = self._price(at, config.override_margin, moves)
        best = int(np.argmin(prices))
        if prices[0] <= prices[best] + config.override_margin:
            best = 0
        arcs, turns = len(moves.rates), len(moves.rates) + len(moves.turns)
        self._turning, self._is_waiting = 0.0, False
        if best < arcs:
            driven = float(moves.rates[best])
            if at.is_near:
                scale = float(moves.scales[best])
                self._is_waiting = scale == 0.0
            else:
                scale = self._speed_scale(at, driven)
            return Twist(robot.speed * scale, rate if best == 0 else driven)
        if best >= turns:
            return Twist(-robot.speed, float(moves.reverse_rates[best - turns]))
        self._turning = math.copysign(robot.max_steering, moves.turns[best - arcs])
        return Twist(0.0, self._turning)

    def _situation(
        self,
        plan: GridPlanner,
        cell: float,
        position: NDArray[np.float64],
        yaw: float,
        movers: TrackedMovers | None,
    ) -> _Situation:
        """Return where the robot is, its body and what can reach it; it counts as a decision."""
        x, y = ((position - plan.corner) / cell).tolist()
        near, is_near = self._forecast(plan, position, movers)
        return _Situation(plan, cell, Place(x, y, yaw), self._relaxed(position), near, is_near)

    def _forecast(
        self, plan: GridPlanner, position: NDArray[np.float64], movers: TrackedMovers | None
    ) -> tuple[MoverForecast, bool]:
        """Return the movers that can reach the robot, and True if there are any."""
        if movers is None or not len(movers.radii):
            return self._nobody, False
        fastest = self.config.max_speed_scale * self._robot.speed
        near = forecast_of(movers, self.config.movers, position, fastest, plan.corner)
        return near, len(near.radii) > 0

    def _with_speeds(self, at: _Situation) -> Candidates:
        """Return the moves with each arc at the largest speed that its ground allows, too.

        The last arc is standing still.
        """
        moves = self._candidates
        fast = [self._speed_scale(at, rate) for rate in moves.rates.tolist()]
        return moves._replace(
            rates=np.concatenate([moves.rates, moves.rates, [0.0]]),
            scales=np.concatenate([moves.scales, fast, [0.0]]),
        )

    def _ground(self, at: _Situation) -> PlannedGround:
        """Return what the plan knows around the robot."""
        plan, cell = at.plan, at.cell
        goal_x, goal_y = ((plan.goal - plan.corner) / cell).tolist()
        return PlannedGround(
            *(plan.costs, plan.clearance, plan.traversed_clearance, plan.search),
            *(cell, goal_x, goal_y, self._goal_radius / cell),
            at.near,
        )

    def _price(
        self, at: _Situation, override_margin: float, moves: Candidates
    ) -> NDArray[np.float64]:
        """Return the prices of all moves that can matter [m], which the next call may overwrite.

        Args:
            at: Where the robot is.
            override_margin: Cost by which a move has to be cheaper than the first arc [m].
            moves: First moves.
        """
        # Backing out takes two stops, and a turn that is still to come.
        stop, turn = self.config.stop_cost, np.pi * self._body.turn_cost
        stops = Stops(self._turning, stop, 2.0 * stop + turn, override_margin)
        prices = self._prices if moves is self._candidates else np.zeros(_count_moves(moves))
        ground = self._ground(at)
        price_moves(moves, self._motion, ground, at.place, at.body, stops, prices)
        return prices

    def _relaxed(self, position: NDArray[np.float64]) -> BodyCircles:
        """Return the body with less margin the longer the robot makes no progress."""
        # Who waits for a mover has not lost the way.
        place = np.inf if self._is_waiting else position
        self._places[self._decisions % len(self._places)] = place
        self._decisions += 1
        stays = _count_near(self._places, position, _STAY_RADIUS)
        time = stays * self.config.action_repeat * CONTROL_PERIOD
        share = min(max(time / self.config.no_progress_time - 1.0, 0.0), 1.0)
        relaxed, body = self.config.clearance_relaxation * share, self._body
        return body._replace(radius=body.radius - relaxed, swing_radius=body.swing_radius - relaxed)

    def _speed_scale(self, at: _Situation, rate: float) -> float:
        """Return the largest share of the speed that an arc may be driven at."""
        config, plan, cell = self.config, at.plan, at.cell
        weights = plan.weights
        most, widest = config.max_speed_scale, config.max_speed_clearance
        for scale, clearance in (
            (most, weights.inflation_radius if widest is None else widest),
            ((1.0 + most) / 2, config.full_speed_clearance),
        ):
            stride = scale * self._robot.speed * STEP / cell
            limit = SpeedLimit(
                clearance / cell,
                weights.inscribed_radius / cell,
                weights.inflation_radius / cell,
                weights.inflation_cost,
            )
            turn, points = rate * STEP, self._motion.points
            if is_free(plan.costs, plan.clearance, limit, at.place, turn, stride, points):
                return scale
        return 1.0


def _count_moves(moves: Candidates) -> int:
    """Return the number of arcs, turns and arcs backwards."""
    return len(moves.rates) + len(moves.turns) + len(moves.reverse_rates)


@kernel
def _count_near(places: NDArray[np.float64], position: NDArray[np.float64], radius: float) -> int:
    """Return the number of places nearer to a position than a radius."""
    count = 0
    for k in range(len(places)):
        count += np.hypot(places[k, 0] - position[0], places[k, 1] - position[1]) < radius
    return count


def arc_fan(
    robot: RobotModel, rates: tuple[float, ...], arcs: int, arc_time: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return all sequences of arcs at constant speed, and the first yaw rate of each.

    Args:
        robot: Speed and steering limit.
        rates: Yaw rates of an arc, as shares of the limit.
        arcs: Number of arcs in a row.
        arc_time: Duration of an arc [s].

    Returns:
        x, y [m] and heading [rad] in the robot's frame, shape (k, m, 3), and the rates [rad/s],
        shape (k,).
    """
    sequences = np.array(list(product(rates, repeat=arcs))) * robot.max_steering
    turns = np.repeat(sequences, round(arc_time / STEP), axis=1) * STEP
    # The heading halfway through a step: an arc's chord points there.
    yaw = np.cumsum(turns, axis=1) - turns / 2
    x = np.cumsum(np.cos(yaw), axis=1) * robot.speed * STEP
    y = np.cumsum(np.sin(yaw), axis=1) * robot.speed * STEP
    return np.stack([x, y, yaw + turns / 2], axis=2), sequences[:, 0]
