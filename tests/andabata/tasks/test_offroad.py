"""The Gymnasium environments keep Gymnasium's and Stable-Baselines3's contracts."""

import gc
import weakref

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env as check_gymnasium
from stable_baselines3.common.env_checker import check_env as check_sb3

from andabata.tasks.episode_monitor import TerminationConfig
from andabata.tasks.offroad import OffroadConfig, make_offroad, stage_config
from andabata.tasks.registration import STAGES
from worlds.splits import TRAINING_SEEDS, judged_release, judging_world

IDS = [f"andabata/{stage}-v0" for stage in STAGES]


@pytest.fixture(scope="module", params=IDS)
def env(request, scenes):
    config = stage_config(request.param.split("/")[1].split("-")[0])
    small = config.model_copy(update={"seeds": (0,)})
    made = gym.make(request.param, config=small, scenes=scenes)
    yield made
    made.close()


@pytest.mark.parametrize("name", IDS)
def test_gymnasium_and_stable_baselines_accept_them(name):
    """Both checkers accept every registered environment."""
    env = gym.make(name).unwrapped
    check_gymnasium(env, skip_render_check=True)
    check_sb3(env, skip_render_check=True)
    env.close()


def test_the_same_seed_gives_the_same_episode(env):
    """Equal seeds and actions give equal states and rewards, to the bit."""

    def episode():
        states, rewards = [env.reset(seed=11)[0]], []
        for k in range(30):
            state, reward, *_ = env.step(np.array([np.sin(k / 5)], dtype=np.float32))
            states.append(state)
            rewards.append(reward)
        return np.array(states), np.array(rewards)

    first, second = episode(), episode()
    np.testing.assert_array_equal(first[0], second[0])
    np.testing.assert_array_equal(first[1], second[1])


def test_the_reward_is_the_sum_of_its_terms(env):
    """The reward is the sum of the four named terms."""
    env.reset(seed=3)
    _, reward, _, _, info = env.step(np.zeros(1, dtype=np.float32))
    assert reward == pytest.approx(sum(info["reward_terms"].values()))
    assert set(info["reward_terms"]) == {"attraction", "repulsion", "collision", "tipover"}


def test_the_dead_zone_and_the_previous_actions_are_in_the_state(env):
    """The state holds the executed yaw rates, newest first; rates in the dead zone are 0."""
    env.reset(seed=4)
    env.step(np.array([0.8], dtype=np.float32))
    state = env.step(np.array([0.2], dtype=np.float32))[0]  # 0.1 rad/s: inside the dead zone.
    np.testing.assert_allclose(state[32:34], [0.0, 0.4], atol=1e-6)


def test_a_silent_laser_leaves_the_state_as_it_was(env, monkeypatch):
    """As beyond the edge of a world, where no beam comes back: the episode goes on without it."""
    before = env.reset(seed=5)[0]
    navigator = env.unwrapped._simulated_robot.navigator
    with monkeypatch.context() as patch:
        patch.setattr(navigator, "observe", lambda readings: None)
        for _ in range(10):
            state, reward, *_ = env.step(np.full(1, 0.9, dtype=np.float32))
            np.testing.assert_array_equal(state, before)
            assert np.isfinite(reward)
    states = [env.step(np.full(1, 0.9, dtype=np.float32))[0] for _ in range(10)]
    assert not np.array_equal(states[-1], before)


def test_time_outs_truncate_and_collisions_terminate(scenes):
    """A time-out truncates without a penalty, a collision terminates with one."""
    config = stage_config("Maze2D").model_copy(
        update={"seeds": (0,), "terminations": TerminationConfig(time_limit=1.0)}
    )
    env = make_offroad("Maze2D", config, scenes=scenes)
    env.reset(seed=0)
    for _ in range(10):
        _, _, terminated, truncated, info = env.step(np.zeros(1, dtype=np.float32))
    assert (terminated, truncated, info["outcome"]) == (False, True, "timeout")
    assert not info["is_success"]
    assert info["reward_terms"]["collision"] == 0.0
    rules = TerminationConfig(time_limit=0.1, timeout_terminates=True)
    env = make_offroad("Maze2D", config.model_copy(update={"terminations": rules}), scenes=scenes)
    env.reset(seed=0)
    assert env.step(np.zeros(1, dtype=np.float32))[2:4] == (True, False)
    env = make_offroad(
        "Maze2D",
        config.model_copy(update={"terminations": TerminationConfig(time_limit=400.0)}),
        scenes=scenes,
    )
    env.reset(seed=0)
    over, steps = False, 0
    while not over and steps < 4000:  # A straight line ends at a wall.
        _, reward, terminated, truncated, info = env.step(np.zeros(1, dtype=np.float32))
        over, steps = terminated or truncated, steps + 1
    assert (terminated, info["outcome"], info["is_success"]) == (True, "collision", False)
    assert info["contact"] == "obstacle"
    assert reward < -900


@pytest.mark.parametrize("heading", ["goal", "subgoal"])
def test_decimated_perception_gives_the_same_scans(scenes, heading):
    """With one scan in five steps, each scan equals that of a robot that scans always."""

    def drive(every):
        changes = {"seeds": (0,), "perception_decimation": every, "heading": heading}
        env = make_offroad(
            "Maze3D", stage_config("Maze3D").model_copy(update=changes), scenes=scenes
        )
        states, attraction = [env.reset(seed=5)[0]], 0.0
        for k in range(40):
            turn = np.array([np.sin(k // 5)], dtype=np.float32)
            state, _, terminated, truncated, info = env.step(turn)
            assert not terminated
            assert not truncated
            states.append(state)
            attraction += info["reward_terms"]["attraction"]
        env.close()
        return np.array(states), attraction

    (often, gained), (seldom, again) = drive(1), drive(5)
    for k in range(40):
        np.testing.assert_array_equal(seldom[k], seldom[k - k % 5])
    np.testing.assert_array_equal(often[::5], seldom[::5])
    assert again == pytest.approx(gained, rel=0.02)


def test_it_keeps_the_robot_of_one_world_alone(scenes):
    """An environment frees the robot of the last world: each holds maps of its own."""
    env = make_offroad("Maze3D", scenes=scenes)
    with pytest.raises(ValueError, match="reset: expected it before the first step"):
        env.step(np.zeros(1, dtype=np.float32))
    env.reset(seed=0, options={"world_seed": 0})
    first = weakref.ref(env._simulated_robot)
    env.reset(seed=1, options={"world_seed": 0})
    assert env._simulated_robot is first()
    env.reset(seed=2, options={"world_seed": 1})
    gc.collect()
    assert first() is None
    env.close()


def test_an_unknown_stage_is_named():
    """An unknown stage is refused with the names that there are."""
    with pytest.raises(ValueError, match="expected Maze2D, Maze3D or Natural, got 'Moon'"):
        stage_config("Moon")


def small(**changes):
    return stage_config("Maze2D").model_copy(update={"seeds": (0, 1, 2), **changes})


def test_a_reached_goal_terminates_with_success(scenes):
    """Within the goal's radius the episode ends for good, as a success without a penalty."""
    rules = TerminationConfig(goal_radius=500.0)
    env = make_offroad("Maze2D", small(terminations=rules), scenes=scenes)
    env.reset(seed=0)
    _, _, terminated, truncated, info = env.step(np.zeros(1, dtype=np.float32))
    assert (terminated, truncated) == (True, False)
    assert (info["is_success"], info["outcome"]) == (True, "goal")
    assert info["reward_terms"]["collision"] == info["reward_terms"]["tipover"] == 0.0


def test_a_stuck_robot_terminates_with_the_penalty(scenes):
    """A robot that does not get away is stuck: an end, and it pays as a collision does."""
    rules = TerminationConfig(stuck_time=0.15, stuck_radius=5.0)
    env = make_offroad("Maze2D", small(terminations=rules), scenes=scenes)
    env.reset(seed=0)
    assert not env.step(np.zeros(1, dtype=np.float32))[2]
    _, _, terminated, truncated, info = env.step(np.zeros(1, dtype=np.float32))
    assert (terminated, truncated, info["outcome"]) == (True, False, "stuck")
    assert info["reward_terms"]["collision"] == -1000.0


@pytest.mark.parametrize("heading", ["goal", "subgoal"])
def test_driving_at_what_attracts_pays(scenes, heading):
    """A robot that faces what attracts is paid 6 a step in the mean."""
    env = make_offroad("Maze2D", small(heading=heading), scenes=scenes)
    state, _ = env.reset(seed=2)
    paid = []
    for _ in range(150):
        turn = np.clip(4 * state[34:], -1, 1).astype(np.float32)
        faces = abs(state[34]) < 0.2
        state, _, terminated, truncated, info = env.step(turn)
        if terminated or truncated:
            break
        if faces:
            paid.append(info["reward_terms"]["attraction"])
    assert len(paid) > 50
    assert np.mean(paid) == pytest.approx(6.0, abs=1.0)


@pytest.mark.parametrize("stage", ["Maze2D", "Maze3D"])
def test_a_near_range_terminates_as_a_collision(scenes, stage):
    """The state of the end is the first with a range under the rule's; nothing was touched."""
    rules = TerminationConfig(time_limit=400.0, collision_range=3.0)
    changes = {"seeds": (0,), "terminations": rules, "heading": "goal", "start_jitter": 0.0}
    config = stage_config(stage).model_copy(update=changes)
    env = make_offroad(stage, config, scenes=scenes)
    state, _ = env.reset(seed=1)
    over, nearest = False, []
    while not over:
        state, _, over, truncated, info = env.step(np.zeros(1, dtype=np.float32))
        nearest.append(state[:32].min())
        assert not truncated
    env.close()
    assert (info["outcome"], info["is_success"], info["contact"]) == ("collision", False, "")
    assert nearest[-1] < 3.0 <= min(nearest[:-1], default=10.0)
    assert info["reward_terms"]["collision"] == -1000.0


def test_a_positive_action_turns_left(scenes):
    """After a positive action the goal lies further to the right."""
    env = make_offroad("Maze2D", small(heading="goal"), scenes=scenes)
    before, _ = env.reset(seed=2)
    for _ in range(10):
        after, *_ = env.step(np.ones(1, dtype=np.float32))
    turned = (after[34] - before[34] + np.pi) % (2 * np.pi) - np.pi
    assert turned == pytest.approx(-0.5, abs=0.25)


def test_episodes_of_other_seeds_begin_elsewhere(scenes):
    """Seeds draw world, task and start; options fix the world and the task."""
    env = make_offroad("Maze2D", small(), scenes=scenes)
    starts = [env.reset(seed=seed)[0] for seed in range(6)]
    assert len(np.unique(starts, axis=0)) == 6
    worlds = {env.reset(seed=seed)[1]["world_seed"] for seed in range(12)}
    assert worlds == {0, 1, 2}
    options = {"world_seed": 1, "task": 0, "difficulty": 0.2}
    assert env.reset(seed=1, options=options)[1]["world_seed"] == 1
    first, _ = env.reset(seed=1, options=options)
    again, _ = env.reset(seed=1, options=options)
    harder, _ = env.reset(seed=1, options={**options, "difficulty": 0.5})
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, harder)
    env.close()


def test_a_reset_without_a_seed_goes_on_with_the_stream(scenes):
    """Episodes after the first differ from it and from each other."""
    env = make_offroad("Maze2D", small(), scenes=scenes)
    states = [env.reset(seed=4)[0], env.reset()[0], env.reset()[0]]
    assert len(np.unique(states, axis=0)) == 3


@pytest.mark.parametrize("stage", STAGES)
def test_spaces_are_those_of_the_robot(stage):
    """35 observations up to the grid's radius, one yaw rate up to the steering limit."""
    config = stage_config(stage)
    observations, actions = config.observations, config.actions
    assert observations.size == 35
    assert observations.term("ranges").high == config.simulated_robot.grid.outer_radius == 10.0
    assert (actions.names, actions.low, actions.high) == (("angular",), (-0.5,), (0.5,))


def test_the_papers_time_limits():
    """180 s in the mazes, 300 s in nature."""
    limits = [stage_config(stage).terminations.time_limit for stage in STAGES]
    assert limits == [180.0, 180.0, 300.0]


def test_stages_draw_their_worlds_from_the_training_seeds():
    """The mazes have all training seeds, nature the first 48 of them."""
    pools = [stage_config(stage).seeds for stage in STAGES]
    assert pools == [TRAINING_SEEDS, TRAINING_SEEDS, TRAINING_SEEDS[:48]]
    assert [stage_config(stage).preset for stage in STAGES] == ["maze", "maze", "natural"]


def test_a_world_that_judges_is_refused_for_training():
    """Before anything is learned; validation takes its own worlds."""
    seed = judging_world("0.2.0", 0)
    with pytest.raises(ValueError, match=r"got 500800000, which judges 0\.2\.0"):
        OffroadConfig(seeds=(*TRAINING_SEEDS, seed))
    assert not any(judged_release(seed) for seed in OffroadConfig().unseen.seeds)
