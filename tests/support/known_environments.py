"""Environments whose best policy is known, for the tests of learners."""

import numpy as np

from rl.spaces import ActionSpec, ObservationSpec, ObservationTerm

TARGETS = ObservationSpec(
    terms=(ObservationTerm(name="targets", shape=(2,), low=-1.0, high=1.0, unit=""),)
)
TWO_ACTIONS = ActionSpec(
    names=("linear", "angular"), low=(0.0, -0.5), high=(0.4, 0.5), units=("m/s", "rad/s")
)


class TurnToGoal:
    """A point that turns; the reward is the cosine of its heading error, after four dead ranges."""

    def reset(self, *, seed=None, options=None):
        rng = np.random.default_rng(seed)
        self._error = float(rng.uniform(-np.pi, np.pi))
        self._steps = 0
        return self._state(), {}

    def step(self, action):
        self._error -= 0.05 * float(action[0])
        self._error = float((self._error + np.pi) % (2 * np.pi) - np.pi)
        self._steps += 1
        reward = float(np.cos(self._error))
        over = self._steps >= 100
        info = {"is_success": abs(self._error) < 0.3, "outcome": "timeout"}
        info["reward_terms"] = {"facing": reward}
        return self._state(), reward, False, over, info

    def _state(self):
        state = np.full(7, 5.0, dtype=np.float32)
        state[-3:] = 0.0, 0.0, self._error
        return state

    def close(self):
        pass


class MatchTargets:
    """Two targets a step, one for each action; the best action repeats the targets in order."""

    def reset(self, *, seed=None, options=None):
        self._rng = np.random.default_rng(seed)
        self._steps = 0
        return self._draw(), {}

    def step(self, action):
        error = np.abs(np.asarray(action) - self._targets)
        self._steps += 1
        reward = -float(error.sum())
        info = {"is_success": bool(error.max() < 0.3), "outcome": "timeout"}
        info["reward_terms"] = {"match": reward}
        return self._draw(), reward, False, self._steps >= 20, info

    def _draw(self):
        self._targets = self._rng.uniform(-0.8, 0.8, 2).astype(np.float32)
        return self._targets

    def close(self):
        pass
