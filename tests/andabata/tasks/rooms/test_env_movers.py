"""Robots among movers: who drove into whom, situations to the bit, earlier scans, rewards."""

import numpy as np
import pytest

from andabata.machine.planar.lidar import PLANAR_LIDARS
from andabata.navigation.planar.mover_shield import MoverShieldConfig
from andabata.tasks.rewards import GdaeRewardConfig, ImprovedRewardConfig
from andabata.tasks.rooms import env as room_env
from andabata.tasks.rooms.env import RoomVectorEnv
from andabata.tasks.rooms.observations import LidarRandomization
from andabata.tasks.rooms.td3_config import Td3TaskConfig
from andabata.tasks.vector import renderer_of
from tests.support.room_robots import AHEAD, SPIN, STAND, drive, part, step
from worlds.rooms.room import Room, RoomPlan

MOVING = Td3TaskConfig(
    rooms=("clutter-movers-5", "clutter-movers-8", "spn-sudden", "spn-env3"), random_rooms=0
)

NEVER = {"randomization": LidarRandomization(share=0.0)}
"""Settings that keep situations, and draw no laser."""


@pytest.fixture
def on_a_way(monkeypatch):
    """Return what makes a robot that heads along x in a bare room with movers."""

    def make(movers, config=MOVING, goal=(3.55, 0.0)):
        plan = RoomPlan.model_validate({"about": "test", "half": (4.0, 3.0), "movers": movers})
        monkeypatch.setattr(room_env, "make_room", lambda name: Room.of(name, plan))
        env = RoomVectorEnv(config.model_copy(update={"rooms": ("bare",)}), 1, autoreset=False)
        env.reset(seed=0, options=drive(0.0, 0.0, 0.0, goal))
        return env

    return make


def ended(env, action):
    """Return how a robot ended that does the same in each step, and after how many of them."""
    for k in range(500):
        _, _, terminated, truncated, info = step(env, action)
        if terminated[0] or truncated[0]:
            return info["outcome"][0], info["contact"][0], k + 1
    raise AssertionError


@pytest.mark.parametrize(
    ("mover", "action", "expected"),
    [
        ({"place": (2.02, 0.0)}, AHEAD, ("collision", "mover", 16)),
        (
            {"place": (2.02, 0.0), "speed": 0.5, "heading_deg": 180},
            STAND,
            ("collision", "hit_at_rest", 31),
        ),
        ({"place": (2.02, 0.0), "speed": 1.5, "heading_deg": 180}, AHEAD, ("collision", "hit", 7)),
        (
            {"place": (-2.02, 0.0), "speed": 1.5, "heading_deg": 0},
            [0.0, 0.0],
            ("collision", "hit", 16),
        ),
        ({"place": (0.0, 2.0)}, AHEAD, ("goal", "", 33)),
        ({"place": (0.0, -2.0)}, SPIN, ("timeout", "", 500)),
    ],
)
def test_infos_tell_who_drove_into_whom(on_a_way, mover, action, expected):
    """A robot that stands is hit; one that drives into a mover is not; walls are obstacles."""
    assert ended(on_a_way([{"radius": 0.3} | mover]), action) == expected


def test_a_wall_is_an_obstacle_in_infos(on_a_way):
    """Contact with what stands is the robot's own doing."""
    env = on_a_way([{"radius": 0.3, "place": (0.0, 2.0)}], goal=(-3.0, 0.0))
    assert ended(env, AHEAD)[:2] == ("collision", "obstacle")


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"earlier_scan": 1},
        {"earlier_scan": 4, "window_unit": "ranges", "goal_encoding": "polar"},
        {"earlier_scan": 2, "points": 30, "lidar": PLANAR_LIDARS["ten-beams-forward"]},
        {"windows": 20, "window_fov_deg": 180.0, "window_unit": "ranges"},
        {"tracked_movers": 2, "earlier_scan": 2, "points": 30},
    ],
)
def test_situations_with_movers_give_the_same_bits(changes):
    """In every step, among movers that bounce, rendering gives what was observed, to the bit."""
    config = MOVING.model_copy(update=NEVER | changes)
    env = RoomVectorEnv(config, 24)
    render, rng, ends, present = renderer_of(config), np.random.default_rng(5), 0, 0
    states, info = env.reset(seed=4)
    for _ in range(80):
        assert env.observation_space.contains(states)
        situations = info["situations"]
        np.testing.assert_array_equal(render(situations, rng), states)
        present += (situations[:, 12] > 0).sum()
        actions = rng.uniform((-0.5, -1.0), 1.0, (24, 2)).astype(np.float32)
        states, _, terminated, truncated, info = env.step(actions)
        if terminated.any():
            last = info["final_obs"][terminated]
            assert (last != states[terminated]).any()
        ends += (terminated | truncated).sum()
    assert ends > 10
    assert present > 500


def test_observations_without_points_are_kept_as_they_are():
    """Where only windows are observed, no situations are given and nothing is rendered again."""
    for config in (MOVING, MOVING.model_copy(update={"earlier_scan": 4})):
        assert "situations" not in RoomVectorEnv(config, 2).reset(seed=0)[1]
        assert renderer_of(config) is None
    drawn = MOVING.model_copy(update={"randomization": LidarRandomization()})
    assert renderer_of(drawn) is not None
    assert "situations" in RoomVectorEnv(drawn, 2).reset(seed=0)[1]


def test_an_earlier_scan_shows_what_moves_and_not_what_stands(on_a_way):
    """A robot at rest sees all windows as before, but for those of a mover, which was farther."""
    mover = {"radius": 0.3, "place": (2.5, 0.0), "speed": 0.5, "heading_deg": 180}
    env = on_a_way([mover], MOVING.model_copy(update={"earlier_scan": 5}))
    for _ in range(8):
        states = step(env, STAND)[0]
    now, before = part(env, states, "windows")[0], part(env, states, "earlier_windows")[0]
    moved = np.abs(now / before - 1) > 1e-5
    assert moved.tolist() == [k in (19, 20) for k in range(40)]
    # The mover's edge is 0.4 m nearer than it began, and came 0.25 m of that since.
    assert 1 / now[20] == pytest.approx(1.8, abs=1e-3)
    assert 1 / before[20] == pytest.approx(2.05, abs=1e-3)


def test_a_robot_that_moves_sees_what_stands_where_it_is_now():
    """While driving and turning, the earlier scan fits the present one better than it did then."""
    config = MOVING.model_copy(update={"rooms": ("spn-env2",), "earlier_scan": 5})
    env, errors = RoomVectorEnv(config, 40), []
    states, _ = env.reset(seed=1)
    history = [part(env, states, "windows")]
    for _ in range(30):
        states, _, terminated, *_ = step(env, *[[0.2, 0.5]] * 40)
        history.append(part(env, states, "windows"))
        kept = part(env, states, "earlier_windows")
        if len(history) > 5 and not terminated.any():
            both = np.stack([kept, history[-6]])
            errors.append(np.abs(both / history[-1] - 1).mean(axis=(1, 2)))
    moved, held = np.mean(errors, axis=0)
    assert moved < 0.3 * held


def test_movers_are_those_of_the_seed():
    """The same seed gives the same movers, now and 50 steps later; another gives others."""
    rows = []
    for seed in (3, 3, 4):
        env = RoomVectorEnv(MOVING.model_copy(update=NEVER), 8, autoreset=False)
        _, info = env.reset(seed=seed)
        first = info["situations"]
        for _ in range(50):
            info = step(env, *[SPIN] * 8)[4]
        rows.append(np.concatenate([first, info["situations"]]))
    np.testing.assert_array_equal(rows[0], rows[1])
    assert (rows[0] != rows[2]).any()


def test_random_rooms_alone_are_drawn_alike():
    """Without named rooms each of the pool comes as often as others, whatever the difficulty."""
    config = Td3TaskConfig(random_rooms=8)
    env = RoomVectorEnv(config, 1600)
    for options in ({}, {"difficulty": 1.0}):
        worlds = env.reset(seed=2, options=options)[1]["world_seed"]
        np.testing.assert_allclose(np.bincount(worlds, minlength=8) / 1600, 0.125, atol=0.03)


def test_gdaes_reward_pays_speed_and_counts_what_is_near(on_a_way):
    """Half of speed less half of turning; from a metre to the nearest obstacle on it costs."""
    config = MOVING.model_copy(update={"reward": GdaeRewardConfig()})
    env = on_a_way([{"radius": 0.3, "place": (1.3, 0.0)}], config)
    terms = {name: term[0] for name, term in step(env, [0.6, -0.4])[4]["reward_terms"].items()}
    assert terms["speed"] == pytest.approx(0.4)
    assert terms["turn"] == pytest.approx(-0.2)
    # The mover's edge was 1 m ahead; 0.08 m were driven.
    assert terms["nearness"] == pytest.approx(-0.04, abs=1e-4)
    assert terms["goal"] == terms["collision"] == 0.0


def test_the_improved_reward_compares_headings_and_distances(on_a_way):
    """Turning to a goal on the left pays, away costs; each drive begins with its own heading."""
    config = MOVING.model_copy(update={"reward": ImprovedRewardConfig()})
    env = on_a_way([{"radius": 0.3, "place": (0.0, -2.0)}], config, goal=(2.0, 2.0))
    found = []
    for action in ([-1.0, 1.0], [-1.0, -1.0], [1.0, 0.0]):
        terms = step(env, action)[4]["reward_terms"]
        found.append((terms["heading"][0], terms["distance"][0]))
    # Driving on past the goal's side its bearing grows; a distance that stays pays as printed.
    assert found == [(1.5, 1.5), (-2.0, 1.5), (-2.0, 1.5)]
    env.reset(seed=0, options=drive(0.0, 0.0, 0.0, (0.0, -2.5)))
    assert step(env, [-1.0, -1.0])[4]["reward_terms"]["heading"][0] == 1.5


@pytest.mark.parametrize("shield", [None, MoverShieldConfig()])
def test_tracked_movers_are_what_the_scans_show(on_a_way, shield):
    """Behind a post nothing is tracked, whatever moves there; in sight it is, after some scans."""
    mover = {"radius": 0.3, "place": (3.0, -1.0), "speed": 0.5, "heading_deg": 90}
    config = MOVING.model_copy(update={"tracked_movers": 3, "shield": shield})
    hidden = on_a_way([mover, {"radius": 0.5, "place": (1.0, 0.0)}], config, goal=(-3.0, 0.0))
    seen = on_a_way([mover], config, goal=(-3.0, 0.0))
    for k in range(20):
        behind, ahead = (part(env, step(env, STAND)[0], "movers")[0] for env in (hidden, seen))
        place = np.array([3.0, -1.0 + 0.05 * (k + 1)])
        if abs(place[1]) < 0.3:
            assert not behind.any()
        assert (k >= 2) or not ahead.any()
    assert ahead[:, 5].tolist() == [1.0, 0.0, 0.0]
    np.testing.assert_allclose(ahead[0, :2] * (place @ place), place, atol=0.05)
    np.testing.assert_allclose(ahead[0, 2:5], [0.0, 0.5, 0.3], atol=0.08)
    # The next drive begins without tracks.
    states, _ = seen.reset(seed=0, options=drive(0.0, 0.0, 0.0, (-3.0, 0.0)))
    assert not part(seen, states, "movers").any()


def test_tracked_movers_change_nothing_else():
    """All other terms, rewards and ends stay the same to the bit."""
    bare, seeing = (
        RoomVectorEnv(MOVING.model_copy(update=u), 8) for u in ({}, {"tracked_movers": 3})
    )
    rng, size = np.random.default_rng(5), bare.config.observations.size
    states, seen = [env.reset(seed=4)[0] for env in (bare, seeing)], 0
    for _ in range(40):
        np.testing.assert_array_equal(states[0], states[1][:, :size])
        actions = rng.uniform((-0.5, -1.0), 1.0, (8, 2)).astype(np.float32)
        (one, *rest, _), (other, *others, _) = (env.step(actions) for env in (bare, seeing))
        states = [one, other]
        np.testing.assert_array_equal(rest, others)
        seen += np.count_nonzero(other[:, -1 - 2 * 6])
    assert seen > 10


def test_a_shield_keeps_a_robot_out_of_the_way(on_a_way):
    """A robot that stands is hit without it; what the policy observes and is paid stays its own."""
    mover = {"radius": 0.3, "place": (2.02, 0.1), "speed": 0.5, "heading_deg": 180}
    config = MOVING.model_copy(update={"shield": MoverShieldConfig()})
    env, bare = on_a_way([mover], config), on_a_way([mover])
    for k in range(45):
        states, _, terminated, _, _ = step(env, STAND)
        assert not terminated[0]
        if k < 5:
            np.testing.assert_array_equal(states, step(bare, STAND)[0])
    assert env.poses[0, 1] < -0.1
