"""Spaces of a robot among points, and observations drawn at random, for the tests of learning."""

from dataclasses import replace

import numpy as np

from rl.spaces import ActionSpec, ObservationSpec, ObservationTerm

ACTIONS = ActionSpec(
    names=("linear", "angular"),
    low=(0.0, -np.pi / 3),
    high=(0.5, np.pi / 3),
    units=("m/s", "rad/s"),
)


def point_observations(n, windows=36):
    """Return a space of n points, their mask, windows, goal and velocities."""

    def term(name, shape, low, high):
        return ObservationTerm(name=name, shape=shape, low=low, high=high, unit="")

    return ObservationSpec(
        terms=(
            term("points", (n, 2), -5.0, 5.0),
            term("mask", (n,), 0.0, 1.0),
            term("windows", (windows,), 0.0, 5.0),
            term("goal", (3,), -1.0, 1.0),
            ObservationTerm(
                name="velocity", shape=(2,), low=-np.pi / 3, high=np.pi / 3, unit="rad/s"
            ),
        )
    )


def observation(n, rng):
    """Return a random observation of n points, the first of which count always."""
    bearings, distances = rng.uniform(-np.pi, np.pi, n), rng.uniform(0.2, 5.0, n)
    mask = rng.random(n) < 0.8
    mask[0] = True
    points = np.stack([np.sin(bearings), np.cos(bearings)], axis=1) / distances[:, None]
    bearing = rng.uniform(-np.pi, np.pi)
    parts = {
        "points": points,
        "mask": mask,
        "windows": rng.uniform(0.2, 5.0, 36),
        "goal": [rng.uniform(0, 1), np.cos(bearing), np.sin(bearing)],
        "velocity": [rng.uniform(0, 0.5), rng.uniform(-1, 1)],
    }
    return point_observations(n).vector(parts)


def with_points(policy, n):
    """Return the same policy for observations of n points."""
    shapes = {"points": (n, 2), "mask": (n,)}
    terms = tuple(
        term.model_copy(update={"shape": shapes.get(term.name, term.shape)})
        for term in policy.observations.terms
    )
    return replace(policy, observations=ObservationSpec(terms=terms))
