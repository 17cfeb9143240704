"""Navigation in rooms: spaces, rewards, ends, what is drawn, what appears, the map."""

import gymnasium as gym
import numpy as np
import pytest

from andabata.machine.planar.lidar import PLANAR_LIDARS
from andabata.navigation.planar.lidar_map import LidarMapConfig
from andabata.navigation.planar.mover_shield import MoverShield, MoverShieldConfig
from andabata.tasks.rooms.env import RoomEnv, RoomVectorEnv
from andabata.tasks.rooms.spn_config import TRAINING_ROOMS, SpnConfig
from andabata.tasks.rooms.td3_config import Td3TaskConfig
from andabata.tasks.rooms.terms import encoded_goals
from andabata.tasks.terminations import TerminationConfig
from andabata.tasks.vector import renderer_of
from tests.support.room_robots import AHEAD, SPIN, STAND, drive, part, step
from worlds.rooms.catalogue import make_room

SMALL = SpnConfig(rooms=("spn-env0",), lidar=PLANAR_LIDARS["ten-beams"], points=10)


def robots(count=1, config=SMALL, autoreset=False, **changes):
    """Return robots of a configuration with some changes."""
    return RoomVectorEnv(config.model_copy(update=changes), count, autoreset)


def test_the_spaces_hold_what_comes():
    """Observations of random drives stay in the box; actions are two shares."""
    env = robots(8, SpnConfig(), autoreset=True)
    assert env.single_action_space == gym.spaces.Box(-1.0, 1.0, (2,), np.float32)
    assert env.single_observation_space.shape == (3 * 120 + 36 + 3 + 2,)
    states, _ = env.reset(seed=0)
    rng = np.random.default_rng(0)
    for _ in range(60):
        assert env.observation_space.contains(states)
        states = env.step(rng.uniform(-1, 1, (8, 2)).astype(np.float32))[0]


def test_shares_become_speed_and_yaw_rate():
    """-1 stands, 1 is 0.5 m/s; the yaw rate goes both ways; what is beyond is cut off."""
    env = robots(3)
    env.reset(seed=0, options=drive(0.0, 0.0, 0.0, (3.0, 0.5)))
    states = step(env, [1.0, 0.0], [-1.0, 1.0], [5.0, -5.0])[0]
    limit = np.pi / 3
    expected = [[0.5, 0.0], [0.0, limit], [0.5, -limit]]
    np.testing.assert_allclose(part(env, states, "velocity"), expected, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(env.poses[:2], [[0.1, 0.0, 0.0], [0.0, 0.0, 0.2 * limit]])


def test_the_goal_ends_a_drive_with_its_reward():
    """0.84 m away the goal is reached with the sixth step; each other pays its progress."""
    env = robots()
    env.reset(seed=0, options=drive(0.0, 0.0, 0.0, (0.84, 0.0)))
    for _ in range(5):
        _, rewards, terminated, truncated, info = step(env, AHEAD)
        assert rewards[0] == pytest.approx(0.1 - 0.02)
        assert not (terminated | truncated).any()
    _, rewards, terminated, truncated, info = step(env, AHEAD)
    assert rewards.tolist() == [5.0]
    assert (terminated[0], truncated[0], info["is_success"][0]) == (True, False, True)
    assert info["outcome"].tolist() == ["goal"]
    assert {name: term[0] for name, term in info["reward_terms"].items()} == {
        "goal": 5.0,
        "collision": 0.0,
        "progress": 0.0,
        "step": 0.0,
    }


def test_contact_ends_a_drive_with_its_penalty():
    """A wall 0.95 m ahead is touched with the eighth step of 0.1 m by a robot of 0.2 m."""
    env = robots()
    env.reset(seed=0, options=drive(3.05, 0.0, 0.0, (-3.0, 0.0)))
    for k in range(8):
        _, rewards, terminated, truncated, info = step(env, AHEAD)
        assert terminated[0] == (k == 7)
    assert rewards.tolist() == [-5.0]
    assert not truncated[0]
    assert info["outcome"].tolist() == ["collision"]
    assert not info["is_success"][0]
    # It stands until it is put down again.
    before = env.poses
    assert step(env, AHEAD)[1].tolist() == [0.0]
    np.testing.assert_array_equal(env.poses, before)


def test_time_ends_a_drive_after_400_steps():
    """A robot that stands is cut off at 80 s, and has paid for each step."""
    env = robots()
    env.reset(seed=0, options=drive(0.0, 0.0, 0.0, (3.0, 0.5)))
    total = 0.0
    for k in range(400):
        _, rewards, terminated, truncated, info = step(env, STAND)
        total += rewards[0]
        assert truncated[0] == (k == 399)
        assert not terminated[0]
    assert info["outcome"].tolist() == ["timeout"]
    assert total == pytest.approx(-8.0)


def test_time_terminates_a_drive_where_the_rules_say_so():
    """The improved TD3's time-out is an end like a collision (Guo et al., Eq. 5)."""
    rules = TerminationConfig(goal_radius=0.3, time_limit=0.4, timeout_terminates=True)
    env = robots(terminations=rules)
    env.reset(seed=0, options=drive(0.0, 0.0, 0.0, (3.0, 0.5)))
    step(env, STAND)
    _, _, terminated, truncated, info = step(env, STAND)
    assert (terminated[0], truncated[0]) == (True, False)
    assert (info["outcome"].tolist(), info["is_success"].tolist()) == (["timeout"], [False])


def test_turns_are_counted():
    """Turning on the spot at full rate for 30 steps is one turn."""
    env = robots(terminations=TerminationConfig(goal_radius=0.3, time_limit=6.0))
    env.reset(seed=0, options=drive(0.0, 0.0, 0.0, (3.0, 0.5)))
    for _ in range(30):
        info = step(env, SPIN)[4]
    assert info["turns"].tolist() == [pytest.approx(1.0)]


def test_a_fixed_task_is_chosen_by_its_number():
    """Tasks are counted over the rooms in their order, whatever the drives are otherwise."""
    env = robots(8, rooms=("spn-env0", "spn-env1"))
    _, info = env.reset(seed=0, options={"task": [0, 1, 2, 3, 4, 5, 6, 7]})
    assert info["world_seed"].tolist() == [0, 0, 0, 0, 1, 1, 1, 1]
    tasks = [*make_room("spn-env0").tasks, *make_room("spn-env1").tasks]
    starts = [[task.start.x, task.start.y, task.start.yaw] for task in tasks]
    np.testing.assert_allclose(env.poses, starts)
    np.testing.assert_allclose(info["situations"][:, 6:8], [task.goal for task in tasks])
    assert [task for _, task in env.config.fixed_tasks] == tasks


def test_fixed_drives_are_the_rooms_own():
    """With fixed tasks nothing else comes, and all of them do."""
    env = robots(64, SMALL.fixed)
    goals = {tuple(row) for row in env.reset(seed=0)[1]["situations"][:, 6:8].round(4).tolist()}
    assert goals == {
        tuple(map(float, goal))
        for goal in np.float32([task.goal for task in make_room("spn-env0").tasks]).round(4)
    }


def test_random_drives_keep_their_distances():
    """Starts and goals are clear and apart, and the same for the same seed."""
    env = robots(100, clearance=0.5, min_distance=3.0)
    _, info = env.reset(seed=1)
    goals, room = info["situations"][:, 6:8].astype(float), make_room("spn-env0")
    assert room.clearance(env.poses[:, :2]).min() > 0.5
    assert room.clearance(goals).min() > 0.5 - 1e-6
    assert np.hypot(*(goals - env.poses[:, :2]).T).min() >= 3.0 - 1e-6
    again = robots(100, clearance=0.5, min_distance=3.0)
    np.testing.assert_array_equal(again.reset(seed=1)[1]["situations"], info["situations"])


@pytest.mark.parametrize(("difficulty", "main_room"), [(0.0, 0), (0.3, 1), (0.6, 2), (1.0, 3)])
def test_the_room_of_the_difficulty_has_most_drives(difficulty, main_room):
    """It has 0.7 of them, each other room 0.1."""
    env = robots(2000, SMALL, rooms=TRAINING_ROOMS)
    worlds = env.reset(seed=2, options={"difficulty": difficulty})[1]["world_seed"]
    shares = np.full(4, 0.1)
    shares[main_room] = 0.7
    np.testing.assert_allclose(np.bincount(worlds, minlength=4) / 2000, shares, atol=0.03)


def test_without_a_difficulty_all_rooms_come_alike():
    """So do those of snapshots' comparison at any difficulty; extra rooms have their share."""
    env = robots(2000, SMALL, rooms=TRAINING_ROOMS)
    worlds = env.reset(seed=2)[1]["world_seed"]
    np.testing.assert_allclose(np.bincount(worlds, minlength=4) / 2000, 0.25, atol=0.03)
    config = SMALL.model_copy(update={"rooms": TRAINING_ROOMS, "random_rooms": 1})
    worlds = robots(2000, config).reset(seed=2)[1]["world_seed"]
    expected = [0.125, 0.125, 0.125, 0.125, 0.5]
    np.testing.assert_allclose(np.bincount(worlds) / 2000, expected, atol=0.03)
    worlds = robots(2000, config.unseen).reset(seed=2, options={"difficulty": 1.0})[1]["world_seed"]
    np.testing.assert_allclose(np.bincount(worlds) / 2000, 0.25, atol=0.03)


def test_what_appears_is_seen_and_hit():
    """Where a person will step in, the wall behind is seen until the robot is 1.3 m from there.

    With the step after that the beam ahead meets the person, and contact ends the drive.
    """
    env = robots(rooms=("spn-sudden",), lidar=PLANAR_LIDARS["front-180"], points=181)
    states, _ = env.reset(seed=0, options={"task": 0})
    for _ in range(40):
        x = env.poses[0, 0]
        ahead = 1 / part(env, states, "points")[0, 90, 1]
        gap = -0.3 - x  # To the person's edge.
        assert ahead == pytest.approx(gap if gap < 1.15 else 1.9 - x, rel=1e-5)
        states, _, terminated, _, info = step(env, AHEAD)
        if terminated[0]:
            break
    assert info["outcome"][0] == "collision"
    assert gap < 0.35
    # The next drive begins without it.
    states, info = env.reset(seed=0, options={"task": 0})
    np.testing.assert_array_equal(info["situations"][0, 8:], 0.0)
    assert part(env, states, "points")[0, 90, 1] == pytest.approx(1 / 5.1)


@pytest.mark.parametrize("rooms", [("spn-env3", "spn-crowded"), ("spn-sudden", "spn-env6")])
def test_situations_give_the_observations_again(rooms):
    """In every step, with what appears and after new drives, rendering gives what was observed."""
    config = SpnConfig(rooms=rooms, lidar=PLANAR_LIDARS["ten-beams"], points=10)
    env = RoomVectorEnv(config, 16)
    render = renderer_of(config)
    states, info = env.reset(seed=4)
    rng, drives = np.random.default_rng(5), 0
    for _ in range(60):
        situations = info["situations"]
        assert situations.shape == (16, render.size)
        np.testing.assert_array_equal(render(situations, rng), states)
        np.testing.assert_array_equal(env.renderer(situations, rng), render(situations, rng))
        actions = rng.uniform((0.0, -1.0), 1.0, (16, 2)).astype(np.float32)
        states, _, terminated, _, info = env.step(actions)
        drives += terminated.sum()
    assert drives > 5


def test_a_drive_by_the_batch_is_a_drive_alone():
    """Robot k of many does what one robot does with seed + k, noise, drift and all."""
    changes = {"noise": 0.02, "drift": 3.0, "rooms": ("spn-env3", "spn-sudden")}
    config = SMALL.model_copy(update=changes)
    env, alone = RoomVectorEnv(config, 3, autoreset=False), RoomEnv(config)
    states, _ = env.reset(seed=7)
    for k in range(3):
        single, _ = alone.reset(seed=7 + k)
        np.testing.assert_array_equal(states[k], single)
    for _ in range(5):
        states, rewards, *_, info = step(env, *[[0.2, 0.3]] * 3)
        single, reward, terminated, truncated, one = alone.step(np.float32([0.2, 0.3]))
        np.testing.assert_array_equal(states[2], single)
        assert (reward, terminated, truncated) == (rewards[2], False, False)
        np.testing.assert_array_equal(one["situations"], info["situations"][2])


def test_noise_is_on_the_points_alone():
    """Points are off by about the deviation; goal, velocity and what returned nothing are not."""
    plain, shaken = robots(40), robots(40, noise=0.02)
    states, seen = (env.reset(seed=3)[0] for env in (plain, shaken))
    for name in ("mask", "goal", "velocity"):
        np.testing.assert_array_equal(part(plain, states, name), part(shaken, seen, name))
    ranges, noisy = (1 / np.hypot(*part(plain, rows, "points").T) for rows in (states, seen))
    returned = ranges < 9.99
    assert (noisy - ranges)[returned].std() == pytest.approx(0.02, rel=0.2)
    np.testing.assert_allclose(noisy[~returned], ranges[~returned], rtol=1e-6)


def test_the_map_gives_sub_goals_and_the_reward_keeps_the_goal():
    """Behind a wall the policy heads for a place beside it; progress is that to the goal itself."""
    config = SpnConfig(rooms=("spn-env6",), lidar=PLANAR_LIDARS["wide-270"], points=40)
    options = drive(-1.5, 0.0, 0.0, (3.8, 0.5))
    plain, mapped = (
        RoomVectorEnv(config.model_copy(update={"map": memory}), 1, autoreset=False)
        for memory in (None, LidarMapConfig())
    )
    straight = part(plain, plain.reset(seed=0, options=options)[0], "goal")[0]
    states, info = mapped.reset(seed=0, options=options)
    target = info["situations"][0, 6:8]
    assert np.hypot(*(target - (-1.5, 0.0))) < 1.8
    guided = part(mapped, states, "goal")[0]
    assert guided[0] * 5 == pytest.approx(np.hypot(*(target - (-1.5, 0.0))), abs=1e-5)
    assert np.hypot(*(guided[1:] - straight[1:])) > 0.5
    rewards = [step(env, [0.0, 0.0])[1][0] for env in (plain, mapped)]
    assert rewards[0] == pytest.approx(rewards[1])


GAP = """about = "gap and door"
half = [4.0, 4.0]
boxes = [[0.9, -1.5, 1.1, -0.33], [0.9, 0.33, 1.1, 4.0], [0.9, -4.0, 1.1, -3.0]]
"""
"""Room with a gap of 0.66 m straight ahead in a wall, and a door of 1.5 m to the right of it."""


@pytest.mark.parametrize(("radius", "passes"), [(0.2, True), (0.35, False)])
def test_the_map_is_that_of_the_robots_own_body(tmp_path, radius, passes):
    """A robot of 0.2 m is led through the gap, one of 0.35 m to the door."""
    (tmp_path / "gap.toml").write_text(GAP)
    robot = SMALL.robot.model_copy(update={"radius": radius})
    changes = {"rooms": (str(tmp_path / "gap.toml"),), "robot": robot, "map": LidarMapConfig()}
    env = robots(lidar=PLANAR_LIDARS["wide-270"], **changes)
    info = env.reset(seed=0, options=drive(0.0, 0.0, 0.0, (3.0, 0.0)))[1]
    x, y = info["situations"][0, 6:8]
    assert x > 0
    assert (abs(y) < 0.3) == passes
    assert passes or y < -0.5


@pytest.mark.parametrize("radius", [0.2, 0.35])
def test_the_shield_is_that_of_the_robots_own_body(monkeypatch, radius):
    """It gets the radius, limits and period of the task's robot."""
    made = []
    monkeypatch.setattr("andabata.tasks.rooms.env.MoverShield", lambda *args: made.append(args))
    robot = SMALL.robot.model_copy(update={"radius": radius})
    robots(robot=robot, shield=MoverShieldConfig())
    ((lidar, own, largest, period, _),) = made
    assert (lidar, own, period) == (SMALL.lidar, radius, 0.2)
    assert (largest.linear, largest.angular) == (robot.max_speed, robot.max_yaw_rate)


def driven(steps=40, count=3, **changes):
    """Return robots after some steps, with all states, rewards and situations of the way."""
    env = robots(count, rooms=("spn-env3",), **changes)
    states, info = env.reset(seed=5)
    told = [(states, np.zeros(count), info["situations"])]
    rng = np.random.default_rng(0)
    for _ in range(steps):
        actions = rng.uniform((0.0, -0.5), (1.0, 0.5), (count, 2)).astype(np.float32)
        states, rewards, *_, info = env.step(actions)
        told.append((states, rewards, info["situations"]))
    return env, [np.array(part) for part in zip(*told, strict=True)]


def test_without_drift_the_truth_is_believed():
    """Poses are true ones, and nothing is computed."""
    env, _ = driven(drift=0.0)
    assert env.batch.odometry is None
    np.testing.assert_array_equal(env.believed_poses, env.poses)


def test_drift_moves_the_believed_pose_alone():
    """True poses, beams, velocities and rewards stay; the goal is where the robot believes it."""
    (env, plain), (other, shaken) = driven(), driven(drift=3.0)
    np.testing.assert_array_equal(env.poses, other.poses)
    np.testing.assert_array_equal(plain[1], shaken[1])
    for name in ("points", "mask", "windows", "velocity"):
        np.testing.assert_array_equal(*(part(env, told[0][-1], name) for told in (plain, shaken)))
    off = np.hypot(*(other.believed_poses - other.poses)[:, :2].T)
    assert (off > 1e-3).all()
    assert (off < 1.0).all()
    goals = plain[2][-1][:, 6:8].astype(np.float64)
    expected = encoded_goals(other.believed_poses, goals, "cosine")
    np.testing.assert_allclose(part(other, shaken[0][-1], "goal"), expected, atol=1e-5)
    assert np.abs(part(env, plain[0][-1], "goal") - expected).max() > 1e-3
    # At the start the robot knows where it is.
    np.testing.assert_allclose(plain[0][0], shaken[0][0], atol=1e-6)


def test_situations_hold_what_was_seen_with_drift():
    """They give the same observations again, to the bit."""
    env, (states, _, situations) = driven(drift=3.0)
    rng = np.random.default_rng(0)
    np.testing.assert_array_equal(env.renderer(situations[-1], rng), states[-1])


def test_drift_and_noise_come_again():
    """The same seed gives the same bytes; the drift has a source of its own."""
    one, two = (driven(drift=1.0, noise=0.02)[1] for _ in range(2))
    for a, b in zip(one, two, strict=True):
        assert a.tobytes() == b.tobytes()
    points = [
        part(env, told[0][-1], "points")
        for env, told in (driven(noise=0.02), driven(drift=1.0, noise=0.02))
    ]
    np.testing.assert_array_equal(*points)


def test_goals_are_judged_by_the_truth():
    """A robot that believes to be elsewhere is at the goal with the step that takes it there."""
    env = robots(drift=10.0)
    env.reset(seed=0, options=drive(0.0, 0.0, 0.0, (0.84, 0.0)))
    for k in range(6):
        env.batch.odometry.poses[:, :2] += 1.0
        assert step(env, AHEAD)[2][0] == (k == 5)


def test_contact_is_judged_by_the_truth():
    """A wall 0.95 m ahead is touched with the eighth step, wherever the robot believes to be."""
    env = robots(drift=10.0)
    env.reset(seed=0, options=drive(3.05, 0.0, 0.0, (-3.0, 0.0)))
    for k in range(8):
        env.batch.odometry.poses[:, :2] -= 1.0
        _, _, terminated, _, info = step(env, AHEAD)
        assert terminated[0] == (k == 7)
    assert info["outcome"].tolist() == ["collision"]


def test_the_map_goes_by_the_believed_pose(monkeypatch, tmp_path):
    """A robot that believes to be a metre aside heads for what leads to a metre aside."""
    aside = np.array([0.0, 1.0, 0.0])

    def restart(odometry, k, pose, rng):
        odometry.poses[k] = pose + aside

    monkeypatch.setattr("andabata.machine.planar.odometry.DeadReckoning.restart", restart)
    (tmp_path / "gap.toml").write_text(GAP)
    robot = SMALL.robot.model_copy(update={"radius": 0.35})
    changes = {"rooms": (str(tmp_path / "gap.toml"),), "robot": robot, "map": LidarMapConfig()}
    targets = []
    for drift, goal in ((1.0, (3.0, 1.0)), (0.0, (3.0, 0.0))):
        env = robots(lidar=PLANAR_LIDARS["wide-270"], drift=drift, **changes)
        info = env.reset(seed=0, options=drive(0.0, 0.0, 0.0, goal))[1]
        targets.append(info["situations"][0, 6:8])
    assert targets[0][1] < -0.5
    np.testing.assert_allclose(*targets, atol=0.02)


def test_the_shield_goes_by_the_believed_pose(monkeypatch):
    """It is given the pose that the robot believes in."""
    poses = []
    monkeypatch.setattr(MoverShield, "update", lambda _, pose, ranges: poses.append(pose))
    env = robots(drift=3.0, shield=MoverShieldConfig())
    env.reset(seed=0, options=drive(0.0, 0.0, 0.0, (3.0, 0.5)))
    for _ in range(5):
        step(env, [1.0, 0.3])
        np.testing.assert_array_equal(poses[-1], env.believed_poses[0])
    assert np.abs(np.array(poses[-1]) - env.poses[0]).max() > 1e-4


def test_a_task_that_is_not_there_is_named():
    """A number beyond the list, and rooms without fixed tasks, are refused."""
    with pytest.raises(ValueError, match="task: expected 0 to 3, got 4"):
        robots(1, rooms=("spn-env0",)).reset(seed=0, options={"task": 4})
    with pytest.raises(ValueError, match="expected fixed tasks"):
        robots(1, rooms=("spn-env5",), tasks="fixed").reset(seed=0)


def test_gdaes_reward_leaves_out_robots_that_were_never_put_down():
    """Of two robots one begins: the other has no beams, and no warning comes of it."""
    config = Td3TaskConfig(rooms=("clutter-7300",), random_rooms=0, reward={"kind": "gdae"})
    env = RoomVectorEnv(config, 2, autoreset=False)
    env.reset(seed=[0, 1], options={"reset_mask": np.array([True, False])})
    _, rewards, *_ = env.step(np.zeros((2, 2), dtype=np.float32))
    assert np.isfinite(rewards[0])


def test_a_rule_of_virtual_scans_is_refused_by_name():
    """A robot in rooms has beams and no virtual scan."""
    rules = TerminationConfig(goal_radius=0.3, collision_range=0.5)
    with pytest.raises(ValueError, match=r"terminations\.collision_range: expected None"):
        robots(terminations=rules)
