"""Planar robots by the batch: what each would do alone, and the maze's task on them."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from andabata.localization.noisy_ground_truth import NoisyGroundTruthConfig
from andabata.machine.kinematic_vehicle import contact_map
from andabata.machine.robot import RobotModel
from andabata.tasks.episode_monitor import TerminationConfig
from andabata.tasks.offroad import OffroadEnv, stage_config
from andabata.tasks.planar import PlanarBatch, PlanarLidar, PlanarVectorEnv, is_planar
from andabata.tasks.planar_kernel import AHEAD, Movers, Obstacles
from rl.mlp import MlpPolicy
from rl.spaces import steering_actions, steering_observations
from rl.training import EpisodeSpec, play, play_together
from terrain.classes import SemanticClass
from terrain.objects import box
from worlds.world import Start

SMALL = stage_config("Maze2D").model_copy(
    update={"seeds": (0, 1, 2), "terminations": TerminationConfig(time_limit=40.0)}
)
ROBOT = RobotModel()
EXACT = NoisyGroundTruthConfig(position_sigma=0.0, yaw_sigma=0.0, tilt_sigma=0.0)


def batch(scenes, count=1, errors=EXACT):
    """Return a batch of robots with four beams, and a world for each scene."""
    lidar = PlanarLidar(np.array([0.0, np.pi / 2, np.pi, -np.pi / 2]), 0.4, 10.0)
    made = PlanarBatch(count, ROBOT, lidar, errors)
    for scene in scenes:
        truth = scene.world.truth
        raster = (truth.x_min, truth.y_min, truth.cell)
        contact = contact_map(truth, made.outline)
        made.add_world(Obstacles(scene.rays.layout, contact, raster))
    return made


@pytest.fixture(scope="module")
def planes(make_scene):
    """Return an empty world and one with a wall whose face is 3 m ahead of the origin."""
    wall = box(SemanticClass.WALL, (3.2, 0.0, 1.0), (0.4, 6.0, 2.0))
    return make_scene(), make_scene(objects=[wall])


def drive(made, twist, steps, count=None):
    count = len(made.stamps) if count is None else count
    twists = np.tile(np.array(twist, dtype=np.float64), (count, 1))
    for _ in range(steps):
        state = made.step(twists, np.ones(count, bool))
    return state


def test_a_robot_drives_ahead_and_its_beam_shortens(planes):
    """A robot moves along its heading at its speed, and what is ahead comes nearer as much."""
    made = batch(planes)
    made.place(0, 1, Start(0.0, 0.0, 0.0), np.random.default_rng(0))
    before = made.observe(np.ones(1, bool)).ranges.copy()
    np.testing.assert_allclose(before[0], [3.0, 10.0, 10.0, 10.0], atol=1e-4)
    state = drive(made, (0.3, 0.0), 40)
    x, y, yaw = state.poses[0]
    assert x == pytest.approx(1.2, abs=0.1)
    assert abs(y) < 0.15
    assert abs(yaw) < 0.1
    assert state.ranges[0, 0] == pytest.approx((3.0 - x) / np.cos(yaw), abs=1e-3)
    assert made.stamps[0] == pytest.approx(4.0)


def test_a_positive_yaw_rate_turns_left(planes):
    """The yaw grows with a positive rate, and the robot curves to its left."""
    made = batch(planes)
    made.place(0, 0, Start(0.0, 0.0, 0.0), np.random.default_rng(0))
    state = drive(made, (0.3, 0.5), 20)
    assert state.poses[0, 2] == pytest.approx(1.0, abs=0.15)
    assert state.poses[0, 1] > 0.1


def test_a_wall_stops_the_body_and_counts_as_contact(planes):
    """A robot that drives at a wall ends in contact, half a body's length before it."""
    made = batch(planes)
    made.place(0, 1, Start(2.0, 0.0, 0.0), np.random.default_rng(0))
    state = drive(made, (0.3, 0.0), 5)
    assert not state.contacts[0]
    state = drive(made, (0.3, 0.0), 40)
    assert state.contacts[0]
    assert 3.0 - state.poses[0, 0] == pytest.approx(ROBOT.length / 2, abs=0.15)
    assert not state.tipped[0]


def test_a_robot_among_many_is_as_alone(planes):
    """With the same generator a robot does the same, to the bit, whoever is beside it."""
    errors = NoisyGroundTruthConfig()
    starts = [Start(0.0, 0.2 * k, 0.3 * k) for k in range(5)]
    twists = np.array([[0.3, 0.1 * k - 0.2] for k in range(5)])
    many = batch(planes, 5, errors)
    for k, start in enumerate(starts):
        many.place(k, k % 2, start, np.random.default_rng(k))
    alone = [batch(planes, 1, errors) for _ in starts]
    for k, start in enumerate(starts):
        alone[k].place(0, k % 2, start, np.random.default_rng(k))
    goals = np.array([[4.0, 1.0]])
    for _ in range(2 * AHEAD + 5):
        state = many.step(twists, np.ones(5, bool))
        for k, one in enumerate(alone):
            single = one.step(twists[k : k + 1], np.ones(1, bool))
            for name in ("poses", "ranges", "contacts", "tipped"):
                np.testing.assert_array_equal(getattr(state, name)[k], getattr(single, name)[0])
            np.testing.assert_array_equal(many.believed_positions[k], one.believed_positions[0])
            turned = many.heading_errors(np.repeat(goals, 5, axis=0))[k]
            assert turned == one.heading_errors(goals)[0]


def test_robots_of_other_seeds_slip_otherwise(planes):
    """Slip and errors come from each robot's own generator, and new draws in every block."""
    made = batch(planes, 3, NoisyGroundTruthConfig())
    for k, seed in enumerate((1, 1, 2)):
        made.place(k, 0, Start(0.0, 0.0, 0.0), np.random.default_rng(seed))
    errors = made.robots.errors.copy()
    np.testing.assert_array_equal(errors[0], errors[1])
    assert (errors[0] != errors[2]).all()
    first = made.robots.slip.copy()
    state = drive(made, (0.3, 0.0), AHEAD)
    np.testing.assert_array_equal(state.poses[0], state.poses[1])
    assert np.abs(state.poses[0] - state.poses[2]).max() > 1e-4
    second = made.robots.slip.copy()
    drive(made, (0.3, 0.0), 1)
    assert (second != first).any()
    assert (made.robots.slip[0] != second[0]).all()


def test_robots_that_are_not_chosen_stand_still(planes):
    """Neither pose, clock, errors nor movers of other robots change."""
    made = batch(planes, 2, NoisyGroundTruthConfig())
    made.movers = Movers(np.full((2, 1, 2), 5.0), np.ones((2, 1, 2)), np.full((2, 1), 0.3))
    for k in range(2):
        made.place(k, 0, Start(0.0, 0.0, 0.0), np.random.default_rng(k))
    before = [np.copy(array) for array in (*made.robots, *made.movers)]
    made.step(np.array([[0.3, 0.4]] * 2), np.array([True, False]))
    for old, new in zip(before, (*made.robots, *made.movers), strict=True):
        np.testing.assert_array_equal(old[1], new[1])
    assert made.stamps.tolist() == [pytest.approx(0.1), 0.0]


def test_wheels_scale_down_what_they_cannot_turn(planes):
    """A twist beyond the wheels' limit is driven slower on the same curve."""
    slow = RobotModel(max_wheel_speed=2.0)
    lidar = PlanarLidar(np.zeros(1), 0.4, 10.0)
    made = PlanarBatch(1, slow, lidar, EXACT)
    truth = planes[0].world.truth
    raster = (truth.x_min, truth.y_min, truth.cell)
    layout = planes[0].rays.layout
    made.add_world(Obstacles(layout, contact_map(truth, made.outline), raster))
    made.place(0, 0, Start(0.0, 0.0, 0.0), np.random.default_rng(0))
    twists = np.array([[1.0, 0.0]])
    for _ in range(20):
        state = made.step(twists, np.ones(1, bool))
    assert state.poses[0, 0] == pytest.approx(2 * 0.2, abs=0.06)  # 2 rad/s of a 10 cm wheel.
    assert twists.tolist() == [[1.0, 0.0]]


def movers(place, velocity, radius=0.4):
    return Movers(
        np.array([[place]], np.float64),
        np.array([[velocity]], np.float64),
        np.array([[radius]], np.float64),
    )


def test_a_mover_moves_and_is_seen_where_it_is(planes):
    """A mover advances by its velocity each period, and the beam follows it."""
    made = batch(planes)
    made.place(0, 0, Start(0.0, 0.0, 0.0), np.random.default_rng(0))
    made.movers = movers((5.0, 0.0), (-0.5, 0.25))
    for k in range(1, 5):
        state = made.step(np.zeros((1, 2)), np.ones(1, bool))
        x, y = 5.0 - 0.05 * k, 0.025 * k
        np.testing.assert_allclose(made.movers.places[0, 0], [x, y])
        expected = x - np.sqrt(0.16 - y * y)
        assert state.ranges[0, 0] == pytest.approx(expected, abs=0.01)
    assert not state.contacts[0]


def test_errors_of_the_believed_pose_wander(planes):
    """Errors keep their standard deviation and lose their memory with the correlation time."""
    errors = NoisyGroundTruthConfig(
        position_sigma=0.5, position_time=2.0, yaw_sigma=0.1, yaw_time=4.0, tilt_sigma=0.02
    )
    made = batch(planes, 1500, errors)
    for k in range(1500):
        made.place(k, 0, Start(0.0, 0.0, 0.0), np.random.default_rng(k))
    first = made.robots.errors.copy()
    sigma, time = np.array([0.5, 0.5, 0.1, 0.02, 0.02]), np.array([2.0, 2.0, 4.0, 4.0, 4.0])
    np.testing.assert_allclose(first.std(axis=0), sigma, rtol=0.07)
    state = drive(made, (0.0, 0.0), 20)
    np.testing.assert_allclose(made.robots.errors.std(axis=0), sigma, rtol=0.07)
    kept = (first * made.robots.errors).mean(axis=0) / sigma**2
    np.testing.assert_allclose(kept, np.exp(-2.0 / time), atol=0.09)
    believed = state.poses[:, :2] + made.robots.errors[:, :2]
    np.testing.assert_array_equal(made.believed_positions, believed)


def wiggle(k, robot):
    return np.float32(np.sin(k / (5 + robot)) * (0.3 + 0.1 * robot))


def test_robots_drive_as_each_would_alone(scenes):
    """Observations, rewards, terms and ends are those of as many single environments."""
    count, steps = 6, 500
    together = PlanarVectorEnv(SMALL, count, scenes, autoreset=False)
    seeds = [40 + robot for robot in range(count)]
    states, info = together.reset(seed=seeds)
    alone = [OffroadEnv(SMALL, scenes=scenes) for _ in range(count)]
    over, ends = np.zeros(count, dtype=bool), set()
    for robot, env in enumerate(alone):
        state, about = env.reset(seed=seeds[robot])
        assert about["world_seed"] == info["world_seed"][robot]
        np.testing.assert_allclose(states[robot], state, atol=2e-6)
    for k in range(steps):
        actions = np.array([[wiggle(k, robot)] for robot in range(count)])
        states, rewards, terminated, truncated, info = together.step(actions)
        for robot, env in enumerate(alone):
            if over[robot]:
                assert not (terminated | truncated)[robot]
                assert rewards[robot] == 0.0
                continue
            state, reward, end, cut, about = env.step(actions[robot])
            # Sines by numpy and by the compiler differ in the last bit.
            np.testing.assert_allclose(states[robot], state, atol=1e-5)
            assert rewards[robot] == pytest.approx(reward, abs=1e-3)
            assert (terminated[robot], truncated[robot]) == (end, cut)
            if end or cut:
                over[robot] = True
                ends.add(about["outcome"])
                for name in ("outcome", "is_success"):
                    assert info[name][robot] == about[name]
                assert info["turns"][robot] == pytest.approx(about["turns"], abs=0.05)
            for name, term in about["reward_terms"].items():
                assert info["reward_terms"][name][robot] == pytest.approx(term, abs=1e-3)
    assert over.all()
    assert ends >= {"collision", "timeout"}


def test_the_next_episode_begins_in_the_same_step(scenes):
    """A time-out truncates, its last state is ``final_obs``, and the next episode goes on."""
    config = SMALL.model_copy(update={"terminations": TerminationConfig(time_limit=1.0)})
    env = PlanarVectorEnv(config, 3, scenes)
    assert env.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    env.reset(seed=5)
    forward = np.zeros((3, 1), dtype=np.float32)
    for _ in range(9):
        _, _, terminated, truncated, _ = env.step(forward)
        assert not (terminated | truncated).any()
    states, _, terminated, truncated, info = env.step(forward)
    assert truncated.all()
    assert not terminated.any()
    assert (info["outcome"] == "timeout").all()
    assert not info["is_success"].any()
    assert not np.allclose(states, info["final_obs"])
    assert env.observation_space.contains(states)
    again, rewards, _, truncated, _ = env.step(forward)
    assert not truncated.any()
    assert np.isfinite(rewards).all()
    assert np.abs(again[:, :32] - states[:, :32]).max() < 2.0  # It goes on from there.


def test_a_reached_goal_ends_the_episode(scenes):
    """A goal terminates with success; the attraction of the last step is that of the move."""
    rules = TerminationConfig(goal_radius=500.0)
    config = SMALL.model_copy(update={"terminations": rules, "heading": "goal"})
    env = PlanarVectorEnv(config, 2, scenes, autoreset=False)
    env.reset(seed=5)
    _, rewards, terminated, truncated, info = env.step(np.zeros((2, 1), np.float32))
    assert terminated.all()
    assert not truncated.any()
    assert info["is_success"].all()
    assert (info["outcome"] == "goal").all()
    assert (np.abs(info["reward_terms"]["attraction"]) < 200 * 0.3 * 0.1 * 1.3).all()
    assert (rewards > -100).all()


def test_driving_at_the_goal_is_attractive(scenes):
    """The attraction is positive for robots that head for the goal, negative for others."""
    config = SMALL.model_copy(update={"heading": "goal", "start_jitter": 0.0})
    env = PlanarVectorEnv(config, 24, scenes, autoreset=False)
    states, _ = env.reset(seed=9)
    for _ in range(5):
        states, _, _, _, info = env.step(np.zeros((24, 1), np.float32))
    ahead = np.abs(states[:, 34]) < 1.2
    behind = np.abs(states[:, 34]) > 1.9
    assert ahead.any()
    assert (info["reward_terms"]["attraction"][ahead] > 0).all()
    assert (info["reward_terms"]["attraction"][behind] < 0).all()


def test_previous_actions_are_those_that_were_executed(scenes):
    """Newest first, after the limit and the dead zone of 0.15 rad/s."""
    env = PlanarVectorEnv(SMALL, 2, scenes, autoreset=False)
    env.reset(seed=1)
    env.step(np.array([[0.8], [-1.0]], np.float32))
    states, *_ = env.step(np.array([[0.2], [0.6]], np.float32))
    np.testing.assert_allclose(states[:, 32:34], [[0.0, 0.4], [0.3, -0.5]], atol=1e-6)


def test_robots_of_one_seed_have_streams_of_their_own(scenes):
    """An integer seeds robot k with seed + k: other starts, and the same again next time."""
    env = PlanarVectorEnv(SMALL, 4, scenes, autoreset=False)
    first, _ = env.reset(seed=5)
    again, _ = env.reset(seed=5)
    np.testing.assert_array_equal(first, again)
    assert len(np.unique(first, axis=0)) == 4
    shifted, _ = env.reset(seed=6)
    np.testing.assert_array_equal(shifted[:3], first[1:])


def test_options_choose_world_and_difficulty(scenes):
    """A world seed and a difficulty for each robot are taken from the options."""
    env = PlanarVectorEnv(SMALL, 2, scenes, autoreset=False)
    options = {"world_seed": 1, "task": 0, "difficulty": [0.0, 0.5]}
    states, info = env.reset(seed=[3, 3], options=options)
    assert info["world_seed"].tolist() == [1, 1]
    assert not np.array_equal(states[0], states[1])
    same, _ = env.reset(seed=[3, 3], options={"world_seed": 1, "task": 0, "difficulty": 0.5})
    np.testing.assert_array_equal(same[0], same[1])
    np.testing.assert_array_equal(same[1], states[1])


def test_a_robot_that_begins_again_leaves_the_others_alone(scenes):
    """A reset of one robot changes nothing of another's drive."""
    env, other = (PlanarVectorEnv(SMALL, 2, scenes, autoreset=False) for _ in range(2))
    env.reset(seed=1)
    other.reset(seed=1)
    actions = np.full((2, 1), 0.5, dtype=np.float32)
    for _ in range(20):
        env.step(actions)
        other.step(actions)
    before, _ = env.reset(seed=[None, 9], options={"reset_mask": np.array([False, True])})
    fresh, _ = PlanarVectorEnv(SMALL, 1, scenes).reset(seed=9)
    np.testing.assert_array_equal(before[1], fresh[0])
    np.testing.assert_array_equal(env.step(actions)[0][0], other.step(actions)[0][0])


def test_gymnasium_makes_it():
    """``make_vec`` of stage 1 is the batch simulator."""
    env = gym.make_vec("andabata/Maze2D-v0", num_envs=2, config=SMALL)
    assert isinstance(env.unwrapped, PlanarVectorEnv)
    env.reset(seed=0)
    states, *_ = env.step(env.action_space.sample())
    assert env.observation_space.contains(states)
    env.close()


def test_impossible_calls_are_named(scenes):
    """Another stage, a step before a reset, too few seeds and NaN are refused."""
    with pytest.raises(ValueError, match="expected a maze, horizontal scanner"):
        PlanarVectorEnv(stage_config("Maze3D"), 2, scenes)
    env = PlanarVectorEnv(SMALL, 2, scenes)
    with pytest.raises(ValueError, match="reset: expected before the first step"):
        env.step(np.zeros((2, 1), dtype=np.float32))
    with pytest.raises(ValueError, match="seed: expected 2"):
        env.reset(seed=[1])
    env.reset(seed=0)
    with pytest.raises(ValueError, match="expected finite"):
        env.step(np.array([[np.nan], [0.0]], dtype=np.float32))


def test_only_stage_one_is_planar():
    """The other stages, and a stage that decides on old scans, need the whole robot."""
    assert is_planar(SMALL)
    assert not is_planar(stage_config("Maze3D"))
    assert not is_planar(stage_config("Natural"))
    assert not is_planar(SMALL.model_copy(update={"perception_decimation": 2}))


def policy():
    """Return a policy of small random weights."""
    rng = np.random.default_rng(1)
    weights = {}
    for k, (outputs, inputs) in enumerate([(16, 35), (2, 16)]):
        weights[f"layer{k}.weight"] = 0.1 * rng.normal(size=(outputs, inputs)).astype(np.float32)
        weights[f"layer{k}.bias"] = np.zeros(outputs, np.float32)
    return MlpPolicy(weights, steering_observations(32, 10.0, 0.5), steering_actions(0.5))


def test_episodes_depend_on_their_seeds_alone(scenes):
    """Any number of robots plays the same episodes, to the bit, in the order of the specs."""
    seeds = [EpisodeSpec(0, (3, 0, k), (None, 0.2)[k % 2]) for k in range(9)]
    played = []
    for lanes in (1, 4, 16):
        robots = PlanarVectorEnv(SMALL, lanes, scenes, autoreset=False)
        played.append(play_together(robots, policy(), 5, seeds))
    alone = [play(OffroadEnv(SMALL, scenes=scenes), policy(), 5, seed) for seed in seeds]
    for few, more, many, one in zip(*played, alone, strict=True):
        for other in (more, many):
            for name in ("states", "actions", "rewards", "last_state"):
                np.testing.assert_array_equal(getattr(few, name), getattr(other, name))
            assert (few.outcome, few.steps) == (other.outcome, other.steps)
        # The last bits of sines differ from a single environment's.
        assert (few.outcome, few.is_success, few.terminated, few.steps) == (
            one.outcome,
            one.is_success,
            one.terminated,
            one.steps,
        )
        np.testing.assert_allclose(few.states, one.states, atol=1e-3)
        np.testing.assert_allclose(few.rewards, one.rewards, atol=0.1)
    assert len({episode.outcome for episode in alone}) > 1
