"""Observation and actions of policies that see what the robot knows: its map, turned with it."""

import math
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from andabata.machine.robot import RobotModel
from andabata.navigation.controller import ControllerInput
from andabata.navigation.map_crops import (
    FAR_CELLS,
    FAR_CHANNELS,
    NEAR_CELLS,
    NEAR_CHANNELS,
    RobotMap,
    far_crop,
    near_crop,
)
from rl.policy import Policy
from rl.spaces import ActionSpec, ObservationSpec, ObservationTerm

MAX_SPEED_SCALE = 2.0
"""Largest speed as a multiple of the robot's constant one, as the planner's."""

_LONGEST_STALL = 60.0
"""Time without coming nearer to the goal from which on more does not matter [s]."""

_NEAR_GOAL = 4.0
"""Distance at which a nearness is a half [m]."""

_RATE_SHARES = (-1.0, -0.66, -0.34, 0.0, 0.34, 0.66, 1.0)
"""Yaw rates of actions that drive on, as shares of the steering limit; those between lie above the
dead zone."""


def _numbers(name: str, count: int, high: float, unit: str) -> ObservationTerm:
    """Return a term of several numbers."""
    return ObservationTerm(name=name, shape=(count,), low=-high, high=high, unit=unit)


def map_observations(robot: RobotModel, has_subgoal: bool) -> ObservationSpec:
    """Return the observation of a policy that sees the map.

    Args:
        robot: Limits of speed and steering.
        has_subgoal: True to show the planner's sub-goal, too.
    """
    crops = tuple(
        ObservationTerm(
            name=name,
            shape=(len(channels), cells, cells),
            low=-1.0,
            high=1.0,
            unit="1",
            scaling="none",
        )
        for name, channels, cells in (
            ("map_near", NEAR_CHANNELS, NEAR_CELLS),
            ("map_far", FAR_CHANNELS, FAR_CELLS),
        )
    )
    names = ("goal", "subgoal") if has_subgoal else ("goal",)
    goals = tuple(_numbers(name, 3, 1.0, "1") for name in names)
    motion = (
        _numbers("previous_speed", 1, MAX_SPEED_SCALE * robot.speed, "m/s"),
        _numbers("previous_actions", 2, robot.max_steering, "rad/s"),
        _numbers("tilt", 2, math.pi / 2, "rad"),
        _numbers("stalled_time", 1, _LONGEST_STALL, "s"),
    )
    return ObservationSpec(terms=crops + goals + motion)


def sees_map(observations: ObservationSpec) -> bool:
    """Return True if observations show the planner's map."""
    return any(term.name in ("map_near", "map_far", "subgoal") for term in observations.terms)


def check_map_policy(policy: Policy, robot: RobotModel) -> None:
    """Refuse a policy whose crops, numbers, actions or body are not those of a robot.

    Args:
        policy: Policy that sees the map.
        robot: Body, and limits of speed and steering.

    Raises:
        ValueError: If they differ; it names the first that does.
    """
    names = [term.name for term in policy.observations.terms]
    expected = map_observations(robot, "subgoal" in names)
    known = {term.name: term for term in expected.terms}
    for term in policy.observations.terms:
        if term != known.get(term.name):
            _refuse(term.name, known.get(term.name, f"one of {', '.join(known)}"), term)
    if missing := [name for name in known if name not in names]:
        _refuse("observations", f"{', '.join(known)}", f"none of {', '.join(missing)}")
    if policy.actions != map_actions(robot):
        _refuse("actions", map_actions(robot), policy.actions)
    taught, body = _taught_body(policy), (robot.length, robot.width)
    if taught is not None and taught != body:
        texts = [f"{length:g} by {width:g} m" for length, width in (body, taught)]
        _refuse("body, length and width", *texts)


def _taught_body(policy: Policy) -> tuple[float, float] | None:
    """Return length and width of the robot that a policy learnt on [m], None if it does not say."""
    config: Any = policy.info.get("config", {})
    robot = config.get("driving", {}).get("simulated_robot", {}).get("robot")
    return None if robot is None else (robot["length"], robot["width"])


def _refuse(name: str, expected: object, got: object) -> NoReturn:
    """Raise the error about a part of a policy."""
    raise ValueError(
        f"policy: expected {name} as this robot has them ({expected}), got {got}; teach one for it "
        "with `andabata policy imitate`"
    )


def map_actions(robot: RobotModel) -> ActionSpec:
    """Return speed and yaw rate within the robot's limits."""
    return ActionSpec(
        names=("linear", "angular"),
        low=(-robot.speed, -robot.max_steering),
        high=(MAX_SPEED_SCALE * robot.speed, robot.max_steering),
        units=("m/s", "rad/s"),
    )


def action_table(robot: RobotModel) -> NDArray[np.float64]:
    """Return speed [m/s] and yaw rate [rad/s] of each of 19 actions, shape (19, 2).

    Seven arcs at twice the robot's speed, seven at its speed, a turn on the spot to each side and
    three arcs backwards.
    """
    limit, speed = robot.max_steering, robot.speed
    ahead = [(scale * speed, share * limit) for scale in (2.0, 1.0) for share in _RATE_SHARES]
    turns = [(0.0, -limit), (0.0, limit)]
    back = [(-speed, share * limit) for share in (-0.5, 0.0, 0.5)]
    return np.array(ahead + turns + back)


def action_shares(robot: RobotModel) -> NDArray[np.float32]:
    """Return ``action_table`` as shares of the actions' bounds from -1 to 1, shape (19, 2)."""
    actions = map_actions(robot)
    low, high = np.array(actions.low), np.array(actions.high)
    shares: NDArray[np.float64] = (2.0 * action_table(robot) - low - high) / (high - low)
    return shares.astype(np.float32)


def mirrored_actions(table: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the number of each action's mirror image, shape (a,).

    Args:
        table: Speed [m/s] and yaw rate [rad/s] of each action, shape (a, 2).

    Raises:
        ValueError: If an action has none.
    """
    images = table * [1.0, -1.0]
    same = np.all(np.abs(images[:, None] - table[None]) < 1e-9, axis=2)
    if not same.any(axis=1).all():
        raise ValueError("actions: expected a mirror image of each action, got one without")
    return np.argmax(same, axis=1)


def mirrored_observations(
    observations: NDArray[np.float32], spec: ObservationSpec
) -> NDArray[np.float32]:
    """Return observations with left and right exchanged.

    Args:
        observations: Observations, shape (n, ``spec.size``).
        spec: Their layout, as ``map_observations`` gives it.
    """
    seen = observations.copy()
    for name in ("map_near", "map_far"):
        shape = spec.term(name).shape
        crops = observations[:, spec.slice_of(name)].reshape(-1, *shape)
        seen[:, spec.slice_of(name)] = crops[..., ::-1].reshape(len(observations), -1)
    for term in spec.terms:
        if term.name in _ODD:
            first = spec.slice_of(term.name).start
            seen[:, first + np.array(_ODD[term.name])] *= -1.0
    return seen


_ODD = {"goal": (1,), "subgoal": (1,), "previous_actions": (0, 1), "tilt": (1,)}
"""Numbers of each term that change their sign when left and right are exchanged."""


def _place_terms(ahead: float, aside: float) -> list[float]:
    """Return cosine and sine of the bearing of a place, and how near it is, from 1 to 0."""
    away = math.hypot(ahead, aside)
    if away < 1e-6:
        return [1.0, 0.0, 1.0]
    return [ahead / away, aside / away, _NEAR_GOAL / (_NEAR_GOAL + away)]


def place_of(terms: NDArray[np.float32]) -> tuple[float, float]:
    """Return how far ahead and to the left a place is [m] whose terms are ``goal`` or ``subgoal``.

    Args:
        terms: Cosine and sine of its bearing, and how near it is, shape (3,).
    """
    cosine, sine, nearness = terms.tolist()
    away = _NEAR_GOAL * (1.0 / max(nearness, 1e-6) - 1.0)
    return away * cosine, away * sine


def goal_in_robot(situation: ControllerInput) -> NDArray[np.float64]:
    """Return the goal itself in the robot's frame [m], shape (2,)."""
    x, y = (situation.goal - situation.pose.position[:2]).tolist()
    c, s = math.cos(situation.pose.yaw), math.sin(situation.pose.yaw)
    return np.array([c * x + s * y, c * y - s * x])


def _around(situation: ControllerInput) -> RobotMap:
    """Return the map around the robot.

    Raises:
        ValueError: If there is none.
    """
    if situation.around is None:
        raise ValueError(
            "map_near, map_far, subgoal: expected a planner that keeps a map, got none; steer by "
            "the controller `policy` of make_steering, which brings one"
        )
    return situation.around


def _near(situation: ControllerInput) -> NDArray[np.float32]:
    """Return the near crop."""
    odometry, goal = situation.odometry, goal_in_robot(situation)
    return near_crop(_around(situation), odometry.position[:2], odometry.yaw, goal)


def _far(situation: ControllerInput) -> NDArray[np.float32]:
    """Return the far crop."""
    odometry, goal = situation.odometry, goal_in_robot(situation)
    return far_crop(_around(situation), odometry.position[:2], odometry.yaw, goal)


def _subgoal(situation: ControllerInput) -> list[float]:
    """Return the planner's sub-goal."""
    away = _around(situation).target - situation.odometry.position[:2]
    distance = float(np.hypot(*away))
    bearing = situation.heading_error
    return _place_terms(distance * math.cos(bearing), distance * math.sin(bearing))


def _tilt(situation: ControllerInput) -> list[float]:
    """Return pitch and roll [rad]."""
    x, y, z, w = situation.odometry.quaternion.tolist()
    pitch = math.asin(min(max(2.0 * (w * y - z * x), -1.0), 1.0))
    return [pitch, math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))]


MAP_TERMS: dict[str, Any] = {
    "map_near": _near,
    "map_far": _far,
    "goal": lambda situation: _place_terms(*goal_in_robot(situation).tolist()),
    "subgoal": _subgoal,
    "previous_speed": lambda situation: [situation.previous_speed],
    "tilt": _tilt,
    "stalled_time": lambda situation: [min(situation.stalled_time, _LONGEST_STALL)],
}
"""Parts of observations that see the map, by name."""
