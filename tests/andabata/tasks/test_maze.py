"""The maze's task on many robots: what each would do alone."""

import gc
import weakref

import gymnasium as gym
import numpy as np
import pytest

from andabata.tasks.episode_monitor import TerminationConfig
from andabata.tasks.maze import MazeVectorEnv, is_planar
from andabata.tasks.offroad import OffroadEnv, stage_config
from rl.policies.mlp import MlpPolicy
from rl.spaces import steering_actions, steering_observations
from rl.training import EpisodeSpec, play, play_together
from worlds.scenes import SceneCache

SMALL = stage_config("Maze2D").model_copy(
    update={"seeds": (0, 1, 2), "terminations": TerminationConfig(time_limit=40.0)}
)


def wiggle(k, robot):
    return np.float32(np.sin(k / (5 + robot)) * (0.3 + 0.1 * robot))


@pytest.mark.parametrize("collision_range", [None, 0.72])
def test_robots_drive_as_each_would_alone(scenes, collision_range):
    """Observations, rewards, terms and ends are those of as many single environments."""
    count, steps = 6, 500
    rules = TerminationConfig(time_limit=40.0, collision_range=collision_range)
    config = SMALL.model_copy(update={"terminations": rules})
    together = MazeVectorEnv(config, count, scenes, autoreset=False)
    seeds = [40 + robot for robot in range(count)]
    states, info = together.reset(seed=seeds)
    alone = [OffroadEnv(config, scenes=scenes) for _ in range(count)]
    over, ends, touched = np.zeros(count, dtype=bool), set(), []
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
                touched.append(about["contact"])
                for name in ("outcome", "is_success"):
                    assert info[name][robot] == about[name]
                assert info["turns"][robot] == pytest.approx(about["turns"], abs=0.05)
            for name, term in about["reward_terms"].items():
                assert info["reward_terms"][name][robot] == pytest.approx(term, abs=1e-3)
    assert over.all()
    assert ends >= {"collision", "timeout"}
    # The rule ends drives before anything is touched.
    assert any(touched) == (collision_range is None)


def test_a_reached_goal_ends_the_episode(scenes):
    """A goal terminates with success; the attraction of the last step is that of the move."""
    rules = TerminationConfig(goal_radius=500.0)
    config = SMALL.model_copy(update={"terminations": rules, "heading": "goal"})
    env = MazeVectorEnv(config, 2, scenes, autoreset=False)
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
    env = MazeVectorEnv(config, 24, scenes, autoreset=False)
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
    env = MazeVectorEnv(SMALL, 2, scenes, autoreset=False)
    env.reset(seed=1)
    env.step(np.array([[0.8], [-1.0]], np.float32))
    states, *_ = env.step(np.array([[0.2], [0.6]], np.float32))
    np.testing.assert_allclose(states[:, 32:34], [[0.0, 0.4], [0.3, -0.5]], atol=1e-6)


def test_gymnasium_makes_it():
    """``make_vec`` of stage 1 is the batch simulator."""
    env = gym.make_vec("andabata/Maze2D-v0", num_envs=2, config=SMALL)
    assert isinstance(env.unwrapped, MazeVectorEnv)
    env.reset(seed=0)
    states, *_ = env.step(env.action_space.sample())
    assert env.observation_space.contains(states)
    env.close()


def test_worlds_are_not_kept_with_their_maps():
    """Tasks stay for the next drive there; the world goes with the cache of scenes."""
    cache = SceneCache(1)
    robots = MazeVectorEnv(SMALL, 1, cache)
    world = weakref.ref(cache.get("maze", 0).world)
    first, _ = robots.reset(seed=5, options={"world_seed": 0, "task": 0})
    robots.reset(options={"world_seed": 1, "task": 0})
    gc.collect()
    assert world() is None
    again, _ = robots.reset(seed=5, options={"world_seed": 0, "task": 0})
    np.testing.assert_array_equal(again, first)


def test_impossible_calls_are_named(scenes):
    """Another stage, a step before a reset, too few seeds and NaN are refused."""
    with pytest.raises(ValueError, match="expected a maze, horizontal scanner"):
        MazeVectorEnv(stage_config("Maze3D"), 2, scenes)
    env = MazeVectorEnv(SMALL, 2, scenes)
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
        robots = MazeVectorEnv(SMALL, lanes, scenes, autoreset=False)
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
