"""Stage 1 for many robots at once: the maze's plant, beams, errors and judge in one compiled pass.

Each robot does what it does in an ``OffroadEnv`` of stage 1, with the same draws: the plant and the
rays are the same compiled functions, called from here.
"""

import math
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from numba import njit
from numpy.typing import NDArray

from andabata.machine.kinematic_vehicle import (
    KinematicConfig,
    contact_map,
    drive_ticks,
    plant_numbers,
)
from andabata.machine.pose import wrap
from andabata.machine.simulator import TICKS_PER_STEP, reseed
from andabata.machine.vehicle import TICK_HZ
from andabata.navigation.local_map import LocalMap
from andabata.navigation.view import Area
from andabata.tasks.judge import Outcome
from andabata.tasks.offroad import OffroadConfig, offroad_spaces
from andabata.tasks.scenes import SceneShelf
from andabata.tasks.trial import jittered
from rl.observation import N_EXTRAS
from rl.rewards import TERMS, repulsion_weights
from traversability.virtual_scan import VirtualScan
from worlds.ray_walk import cast_rays
from worlds.rays import Layout
from worlds.world import Start, Task, choose_task

State = NDArray[np.float32]

_AHEAD = 16
"""Steps whose draws are made at once."""

_GOING, _GOAL, _COLLISION, _TIPOVER, _STUCK, _TIMEOUT = range(6)
OUTCOMES = (None, Outcome.GOAL, Outcome.COLLISION, Outcome.TIPOVER, Outcome.STUCK, Outcome.TIMEOUT)
"""What the compiled pass's numbers mean."""


class _Robots(NamedTuple):
    """The robots, one row each.

    Attributes:
        worlds: Which of the laid-out worlds each is in.
        motions: Of the plant: x, y, yaw, speed, yaw rate, slip of both, sideways speed.
        flags: Whether each touches something, and whether it has rolled over.
        errors: Of the pose that it believes: x, y, yaw, roll, pitch.
        commands: The last two executed yaw rates, newest first [rad/s].
        goals: x and y [m].
        distances: To the goal [m].
        anchors: Where it was last seen to move, x, y [m] and when [s].
        steps: Control steps of its drive.
        slip: Standard normal draws of the plant, for ``_AHEAD`` steps.
        wander: Of the errors.
    """

    worlds: NDArray[np.int64]
    motions: NDArray[np.float64]
    flags: NDArray[np.bool_]
    errors: NDArray[np.float64]
    commands: NDArray[np.float64]
    goals: NDArray[np.float64]
    distances: NDArray[np.float64]
    anchors: NDArray[np.float64]
    steps: NDArray[np.int64]
    slip: NDArray[np.float64]
    wander: NDArray[np.float64]

    @classmethod
    def make(cls, count: int) -> "_Robots":
        """Return room for some robots."""
        return cls(
            np.zeros(count, dtype=np.int64),
            np.zeros((count, 8)),
            np.zeros((count, 2), dtype=np.bool_),
            np.zeros((count, 5)),
            np.zeros((count, 2)),
            np.zeros((count, 2)),
            np.zeros(count),
            np.zeros((count, 3)),
            np.zeros(count, dtype=np.int64),
            np.zeros((count, _AHEAD, TICKS_PER_STEP, 2)),
            np.zeros((count, _AHEAD, 5)),
        )


class _Worlds(NamedTuple):
    """Mazes of one size, laid out behind each other."""

    heights: NDArray[np.float32]
    surface: NDArray[np.uint8]
    contact: NDArray[np.uint8]
    tops: NDArray[np.float64]
    things: NDArray[np.int64]
    kinds: NDArray[np.uint8]
    boxes: NDArray[np.float64]
    starts: NDArray[np.int64]
    faces: NDArray[np.int64]
    planes: NDArray[np.float64]
    firsts: NDArray[np.int64]
    lists: NDArray[np.int64]
    members: NDArray[np.int64]
    frame: NDArray[np.float64]
    lattice: NDArray[np.float64]
    squares: NDArray[np.int64]
    raster: NDArray[np.float64]


class _Maze(NamedTuple):
    """A world: what rays meet, tasks, ``contact_map``, x, y and cell of that [m], and area."""

    layout: Layout
    tasks: tuple[Task, ...]
    contact: NDArray[np.uint8]
    raster: tuple[float, float, float]
    area: Area


class _Rules(NamedTuple):
    """Numbers of robot, plant, errors, beams, judge and reward; see ``_make_rules``."""

    body: NDArray[np.float64]
    limits: NDArray[np.float64]
    sliding: NDArray[np.float64]
    wheels: NDArray[np.float64]
    outline: NDArray[np.float64]
    keep: NDArray[np.float64]
    spread: NDArray[np.float64]
    beams: NDArray[np.float64]
    judge: NDArray[np.float64]
    reward: NDArray[np.float64]
    weights: NDArray[np.float64]


class FlatVectorEnv(gym.vector.VectorEnv[State, NDArray[np.float32], Any]):
    """Many robots of stage 1 in one process; see ``OffroadEnv`` for actions, states and rewards.

    With ``autoreset`` a robot whose episode ends begins the next one in the same step: its last
    state is in ``info["final_obs"]``. Without, whoever drives begins it with
    ``reset(seed=..., options={"reset_mask": ...})``, and until then the robot stands still.
    """

    def __init__(
        self,
        config: OffroadConfig,
        num_envs: int,
        shelf: SceneShelf | None = None,
        autoreset: bool = True,
    ) -> None:
        """Prepare a stage for a number of robots.

        Args:
            config: Of a stage with the horizontal scanner, the kinematic plant and the true pose.
            num_envs: Robots.
            shelf: Scenes to share.
            autoreset: See above.

        Raises:
            ValueError: If the stage is another.
        """
        rig = config.rig
        if not is_flat(config):
            raise ValueError(
                "rig: expected a maze, horizontal scanner, kinematic plant and true pose, got "
                f"{config.preset}, {rig.sensing.scanner}, {rig.plant}, {rig.localizer}; use "
                "OffroadVectorEnv"
            )
        self.config, self.num_envs = config, num_envs
        mode = AutoresetMode.SAME_STEP if autoreset else AutoresetMode.DISABLED
        self.metadata = {"autoreset_mode": mode, "render_modes": []}
        self.single_observation_space, self.single_action_space = offroad_spaces(config)
        self.observation_space = gym.vector.utils.batch_space(
            self.single_observation_space, num_envs
        )
        self.action_space = gym.vector.utils.batch_space(self.single_action_space, num_envs)
        self._autoreset = autoreset
        self._shelf = shelf or SceneShelf()
        self._mazes: list[_Maze] = []
        self._numbers: dict[tuple[int, float | None], int] = {}
        self._maps: list[LocalMap] = []
        self._places = np.zeros((num_envs, 2))
        if config.heading == "subgoal":
            self._maps = [LocalMap(rig.grid, rig.local_map) for _ in range(num_envs)]
        self._robots = _Robots.make(num_envs)
        self._rngs = [np.random.default_rng() for _ in range(num_envs)]
        self._slips = [np.random.default_rng(0) for _ in range(num_envs)]
        self._wanders = [np.random.default_rng(0) for _ in range(num_envs)]
        self._over = np.ones(num_envs, dtype=np.bool_)
        self._states = np.zeros((num_envs, rig.grid.n_sectors + N_EXTRAS), dtype=np.float32)
        self._terms = np.zeros((num_envs, 4))
        self._outcomes = np.zeros(num_envs, dtype=np.int64)
        self._worlds: _Worlds | None = None
        self._rules = self._make_rules()

    def reset(
        self,
        *,
        seed: int | list[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[State, dict[str, Any]]:
        """Begin an episode of each robot, or of those in ``options["reset_mask"]``.

        Raises:
            ValueError: If there is not one seed for each robot.
        """
        if seed is None or isinstance(seed, int):
            first = seed
            seed = [None if first is None else first + k for k in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(f"seed: expected {self.num_envs} of them, got {len(seed)}")
        options = options or {}
        chosen = options.get("reset_mask", np.ones(self.num_envs, dtype=np.bool_))
        levels = options.get("difficulty")
        if not isinstance(levels, list):
            levels = [levels] * self.num_envs
        worlds = np.zeros(self.num_envs, dtype=np.int64)
        for k in np.flatnonzero(chosen).tolist():
            worlds[k] = self._begin(k, seed[k], {**options, "difficulty": levels[k]})
        self._look(chosen)
        return self._states.copy(), {"world_seed": worlds, "_world_seed": chosen.copy()}

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[State, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Steer every robot for one control period of 0.1 s.

        Raises:
            ValueError: If an action is not a finite number, or nothing was reset yet.
        """
        if not self._mazes:
            raise ValueError("reset: expected before the first step, got none")
        if not np.isfinite(actions).all():
            raise ValueError("actions: expected finite shares of the steering limit, got others")
        going = ~self._over
        self._draw(going)
        steering = actions[:, 0].astype(np.float64) * self.config.rig.robot.max_steering
        self._pass(steering, going, True)
        self._terms[~going] = 0.0
        rewards = self._terms.sum(axis=1)
        over = going & (self._outcomes != _GOING)
        truncated = over & (self._outcomes == _TIMEOUT)
        terms = dict(zip(TERMS, self._terms.T.copy(), strict=True))
        info: dict[str, Any] = {"reward_terms": terms}
        if over.any():
            self._end(over, info)
        return self._states.copy(), rewards, over & ~truncated, truncated, info

    def _end(self, over: NDArray[np.bool_], info: dict[str, Any]) -> None:
        """Tell how episodes ended and, with autoreset, begin the next ones."""
        info["is_success"] = over & (self._outcomes == _GOAL)
        info["outcome"] = np.array([str(OUTCOMES[k] or "") for k in self._outcomes], dtype=object)
        info["_is_success"] = info["_outcome"] = over.copy()
        self._over |= over
        if self._autoreset:
            info["final_obs"], info["_final_obs"] = self._states.copy(), over.copy()
            for k in np.flatnonzero(over).tolist():
                self._begin(k, None, {})
            self._look(over)

    def _begin(self, k: int, seed: int | None, options: dict[str, Any]) -> int:
        """Put a robot down as ``OffroadEnv.reset`` does; return the world's seed."""
        config = self.config
        if seed is not None:
            self._rngs[k] = gym.utils.seeding.np_random(seed)[0]
        rng = self._rngs[k]
        world_seed = int(options.get("world_seed", rng.choice(config.seeds)))
        level = options.get("difficulty")
        number = self._number_of(world_seed, config.difficulty if level is None else level)
        task = choose_task(self._mazes[number].tasks, options.get("task", rng))
        start = jittered(task.start, rng, config.start_jitter, config.heading_jitter)
        self._place(k, number, start, np.array(task.goals[0]), rng.spawn(1)[0])
        return world_seed

    def _place(
        self, k: int, number: int, start: Start, goal: NDArray[np.float64], rng: np.random.Generator
    ) -> None:
        """Put a robot down at rest; its streams come from ``rng`` in the order of ``Rig.place``."""
        robots = self._robots
        reseed(self._slips[k], rng)
        rng.integers(2**63)  # The beams' stream: there is nothing porous in a maze.
        reseed(self._wanders[k], rng)
        robots.worlds[k] = number
        robots.motions[k] = 0.0
        robots.motions[k, :3] = start.x, start.y, start.yaw
        robots.flags[k] = False
        robots.commands[k] = 0.0
        robots.goals[k] = goal
        robots.anchors[k] = start.x, start.y, 0.0
        robots.steps[k] = 0
        if self._maps:
            self._maps[k].reset()
            self._maps[k].keep_inside(self._mazes[number].area)
        robots.errors[k] = self._rules.spread[0] * self._wanders[k].standard_normal(5)
        self._over[k] = False

    def _number_of(self, world_seed: int, difficulty: float | None) -> int:
        """Return the place of a world among those laid out, laying it out the first time."""
        key = (world_seed, difficulty)
        if key not in self._numbers:
            scene = self._shelf.get(self.config.preset, world_seed, difficulty)
            truth = scene.world.truth
            self._numbers[key] = len(self._mazes)
            self._mazes.append(
                _Maze(
                    scene.rays.layout,
                    scene.world.tasks,
                    contact_map(truth, self._rules.outline),
                    (truth.x_min, truth.y_min, truth.cell),
                    scene.area,
                )
            )
            self._worlds = None
        return self._numbers[key]

    def _draw(self, going: NDArray[np.bool_]) -> None:
        """Make the draws of the next steps where they have run out."""
        robots = self._robots
        for k in np.flatnonzero(going & (robots.steps % _AHEAD == 0)):
            self._slips[k].standard_normal(out=robots.slip[k])
            self._wanders[k].standard_normal(out=robots.wander[k])

    def _look(self, chosen: NDArray[np.bool_]) -> None:
        """Fill the states of robots that were put down."""
        self._pass(np.zeros(self.num_envs), chosen, False)

    def _pass(self, steering: NDArray[np.float64], chosen: NDArray[np.bool_], move: bool) -> None:
        """Let robots move and look, or only look."""
        if self._worlds is None:
            self._worlds = _lay_out(self._mazes)
        advance(
            steering,
            chosen,
            move,
            self._robots,
            self._worlds,
            self._rules,
            self._states,
            self._terms,
            self._outcomes,
        )
        if self._maps:
            for k in np.flatnonzero(chosen).tolist():
                self._head_for_subgoal(k, move)

    def _head_for_subgoal(self, k: int, moved: bool) -> None:
        """Put the bearing of a robot's sub-goal into its state, as ``OffroadEnv`` does."""
        robots, state = self._robots, self._states[k]
        grid = self.config.rig.grid
        here = robots.motions[k, :2] + robots.errors[k, :2]
        bearing = float(_heading_error(robots.motions[k], robots.errors[k], robots.goals[k]))
        to_goal = robots.goals[k] - here
        yaw = wrap(math.atan2(to_goal[1], to_goal[0]) - bearing)
        if moved:
            target = self._maps[k].target
            nearer = math.dist(self._places[k], target) - math.dist(here, target)
            self._terms[k, 0] = self.config.reward.attraction * nearer
        self._places[k] = here
        local_map, ranges = self._maps[k], state[:-N_EXTRAS]
        cells = VirtualScan(ranges, grid.outer_radius).cells_of(grid)
        state[-1] = local_map.bearing(cells, here, yaw, bearing, float(np.hypot(*to_goal)))
        ranges[:] = local_map.shortened(ranges, here, yaw)

    def _make_rules(self) -> _Rules:
        """Return every number that the compiled pass needs."""
        config, rig = self.config, self.config.rig
        robot, errors, judge, reward = rig.robot, rig.errors, config.judge, config.reward
        plant = plant_numbers(robot, KinematicConfig())
        sigma = np.array([errors.position_sigma] * 2 + [errors.yaw_sigma] + [errors.tilt_sigma] * 2)
        times = np.array([errors.position_time] * 2 + [errors.yaw_time] * 3)
        keep = np.exp(-TICKS_PER_STEP / TICK_HZ / times)
        return _Rules(
            body=np.array(
                [
                    robot.speed,
                    robot.max_steering,
                    robot.dead_zone,
                    robot.effective_track / 2,
                    robot.wheel_radius,
                    robot.max_wheel_speed,
                    robot.lidar_height,
                    plant.slip,
                ]
            ),
            limits=plant.limits,
            sliding=plant.sliding,
            wheels=plant.wheels,
            outline=plant.outline,
            keep=keep,
            spread=np.stack([sigma, sigma * np.sqrt(1 - keep * keep)]),
            beams=np.stack([np.cos(rig.grid.bearings), np.sin(rig.grid.bearings)], axis=1),
            judge=np.array(
                [judge.goal_radius, judge.time_limit, judge.stuck_time, judge.stuck_radius]
            ),
            reward=np.array(
                [
                    reward.attraction,
                    reward.max_range,
                    reward.collision,
                    reward.tipover,
                    rig.grid.outer_radius,
                ]
            ),
            weights=repulsion_weights(reward, rig.grid.n_sectors),
        )

    def close_extras(self, **_: Any) -> None:  # noqa: ANN401 - Gymnasium's own form.
        """There is nothing to free."""


def is_flat(config: OffroadConfig) -> bool:
    """Return whether a stage is one that the compiled pass drives."""
    rig = config.rig
    kind = (config.preset, rig.sensing.scanner, rig.plant, rig.localizer)
    plain = rig.sensing.proprioception is None and rig.sensing.grid == rig.grid
    return plain and kind == ("maze", "horizontal", "kinematic", "truth")


def _lay_out(mazes: list[_Maze]) -> _Worlds:
    """Return worlds behind each other.

    Raises:
        ValueError: If they are not of one size.
    """
    layouts = [maze.layout for maze in mazes]
    shapes = {(ground.heights.shape, blocks.tops.shape) for ground, _, blocks in layouts}
    if len(shapes) > 1:
        raise ValueError(f"worlds: expected mazes of one size, got {sorted(shapes)}")
    ground, _, blocks = layouts[0]
    things = [things for _, things, _ in layouts]
    return _Worlds(
        heights=np.stack([ground.heights for ground, _, _ in layouts]),
        surface=np.stack([ground.surface for ground, _, _ in layouts]),
        contact=np.stack([maze.contact for maze in mazes]),
        tops=np.stack([blocks.tops for _, _, blocks in layouts]),
        things=_ends([len(each.kinds) for each in things]),
        kinds=np.concatenate([each.kinds for each in things]),
        boxes=np.concatenate([each.boxes for each in things]),
        starts=np.concatenate([each.starts for each in things]),
        faces=_ends([len(each.planes) for each in things]),
        planes=np.concatenate([each.planes for each in things]),
        firsts=np.stack([blocks.firsts for _, _, blocks in layouts]),
        lists=_ends([len(blocks.members) for _, _, blocks in layouts]),
        members=np.concatenate([blocks.members for _, _, blocks in layouts]),
        frame=ground.frame,
        lattice=np.array([*blocks.lattice[:3], *_heights_of(layouts)]),
        squares=blocks.squares,
        raster=np.array(mazes[0].raster),
    )


def _heights_of(layouts: list[Any]) -> tuple[float, float]:
    """Return less and more than any z of the worlds [m]."""
    floors = [blocks.lattice[3] for _, _, blocks in layouts]
    return min(floors), max(blocks.lattice[4] for _, _, blocks in layouts)


def _ends(counts: list[int]) -> NDArray[np.int64]:
    """Return where each part begins, and the end of the last."""
    return np.cumsum([0, *counts])


@njit(cache=True, nogil=True, error_model="numpy")
def advance(steering, chosen, move, robots, worlds, rules, states, terms, outcomes):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Let each chosen robot move for a control step, where ``move``, and look around."""
    sectors = len(rules.beams)
    rays = np.zeros((sectors, 6), dtype=np.float32)
    budgets = np.full(sectors, np.inf, dtype=np.float32)
    ranges = np.empty(sectors, dtype=np.float32)
    classes = np.empty(sectors, dtype=np.uint8)
    rows = np.empty((TICKS_PER_STEP, 9))
    twist = np.empty(2)
    noise = np.empty((TICKS_PER_STEP, 2))
    for k in range(len(chosen)):
        if not chosen[k]:
            continue
        w, motion = robots.worlds[k], robots.motions[k]
        if move:
            _command(steering[k], robots.commands[k], rules.body, twist)
            here = robots.steps[k] % _AHEAD
            for t in range(TICKS_PER_STEP):
                for c in range(2):
                    noise[t, c] = rules.body[7] * robots.slip[k, here, t, c]
            robots.flags[k, 0] = False
            drive_ticks(
                motion,
                twist,
                noise,
                rules.limits,
                rules.sliding,
                (worlds.heights[w], worlds.frame[2], rules.wheels),
                (
                    worlds.contact[w],
                    worlds.raster[0],
                    worlds.raster[1],
                    worlds.raster[2],
                    rules.outline,
                ),
                rows,
                robots.flags[k],
            )
            for e in range(5):
                robots.errors[k, e] *= rules.keep[e]
                robots.errors[k, e] += rules.spread[1, e] * robots.wander[k, here, e]
            robots.steps[k] += 1
        c, s = np.cos(motion[2]), np.sin(motion[2])
        for sector in range(sectors):
            rays[sector, 0], rays[sector, 1] = motion[0], motion[1]
            rays[sector, 2] = rules.body[6]
            rays[sector, 3] = rules.beams[sector, 0] * c - rules.beams[sector, 1] * s
            rays[sector, 4] = rules.beams[sector, 1] * c + rules.beams[sector, 0] * s
        things, faces, lists = worlds.things, worlds.faces, worlds.lists
        cast_rays(
            rays,
            budgets,
            rules.reward[4],
            worlds.heights[w],
            worlds.surface[w],
            worlds.frame,
            worlds.kinds[things[w] : things[w + 1]],
            worlds.boxes[things[w] : things[w + 1]],
            worlds.starts[things[w] + w : things[w + 1] + w + 1],
            worlds.planes[faces[w] : faces[w + 1]],
            worlds.lattice,
            worlds.squares,
            worlds.tops[w],
            worlds.firsts[w],
            worlds.members[lists[w] : lists[w + 1]],
            ranges,
            classes,
        )
        repulsion = 0.0
        for sector in range(sectors):
            if not np.isfinite(ranges[sector]):
                ranges[sector] = rules.reward[4]
            states[k, sector] = ranges[sector]
            repulsion += rules.weights[sector] * (rules.reward[1] - ranges[sector])
        states[k, sectors], states[k, sectors + 1] = robots.commands[k]
        states[k, sectors + 2] = _heading_error(motion, robots.errors[k], robots.goals[k])
        before = robots.distances[k]
        distance = np.hypot(robots.goals[k, 0] - motion[0], robots.goals[k, 1] - motion[1])
        robots.distances[k] = distance
        if move:
            outcome = _verdict(
                robots.flags[k], motion, distance, robots.anchors[k], robots.steps[k], rules.judge
            )
            outcomes[k] = outcome
            terms[k, 0] = rules.reward[0] * (before - distance)
            terms[k, 1] = -repulsion
            terms[k, 2] = rules.reward[2] if outcome in (_COLLISION, _STUCK) else 0.0
            terms[k, 3] = rules.reward[3] if outcome == _TIPOVER else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _command(steering, commands, body, twist):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write the twist of a wanted yaw rate as ``Navigator.command`` and ``SkidSteer`` do."""
    speed, limit, dead_zone, half_track, radius, fastest = body[:6]
    executed = min(max(steering, -limit), limit)
    if abs(executed) < dead_zone:
        executed = 0.0
    commands[1] = commands[0]
    commands[0] = executed
    left = (speed - executed * half_track) / radius
    right = (speed + executed * half_track) / radius
    scale = min(1.0, fastest / max(abs(left), abs(right), 1e-12))
    left, right = left * scale * radius, right * scale * radius
    twist[0], twist[1] = (left + right) / 2, (right - left) / (2 * half_track)


@njit(cache=True, nogil=True, error_model="numpy")
def _heading_error(motion, errors, goal):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the bearing of the goal from where the robot believes to be and to head [rad]."""
    c, s = np.cos(motion[2]), np.sin(motion[2])
    cr, sr, cp, sp = np.cos(errors[3]), np.sin(errors[3]), np.cos(errors[4]), np.sin(errors[4])
    yaw = errors[2] + np.arctan2(s * cr, c * cp + s * sr * sp)
    x, y = motion[0] + errors[0], motion[1] + errors[1]
    angle = np.arctan2(goal[1] - y, goal[0] - x) - yaw
    return np.pi - (np.pi - angle) % (2 * np.pi)


@njit(cache=True, nogil=True, error_model="numpy")
def _verdict(flags, motion, distance, anchor, steps, judge):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return how the drive ended, if it did, as ``Judge`` does."""
    stamp = steps * TICKS_PER_STEP / TICK_HZ
    if flags[1]:
        return _TIPOVER
    if flags[0]:
        return _COLLISION
    if distance < judge[0]:
        return _GOAL
    if np.hypot(motion[0] - anchor[0], motion[1] - anchor[1]) > judge[3]:
        anchor[0], anchor[1], anchor[2] = motion[0], motion[1], stamp
    if stamp - anchor[2] > judge[2]:
        return _STUCK
    return _TIMEOUT if stamp >= judge[1] else _GOING
