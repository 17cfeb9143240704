"""A policy on a set of points: of any number, in any order, and what supports its action."""

import numpy as np
import pytest

from rl.policies.point_set import PointSetPolicy
from rl.policy import policy_from_bytes
from rl.spaces import ActionSpec, ObservationSpec, ObservationTerm
from tests.support.point_sets import ACTIONS, observation, point_observations, with_points

torch = pytest.importorskip("torch")


@pytest.fixture(scope="module")
def policy():
    return made()


def made(n=30, seed=0, **settings):
    from rl.point_set_actor import PointSetActor

    torch.manual_seed(seed)
    return PointSetActor(point_observations(n), ACTIONS, (16, 16), **settings).policy({"k": 20})


def draws(n, seed=0, rows=40):
    rng = np.random.default_rng(seed)
    return [observation(n, rng) for _ in range(rows)]


@pytest.mark.parametrize("n", [1, 10, 64, 65, 120, 1080])
def test_it_is_the_formula(policy, n):
    """Any number of points gives Eq. 1, maxima and the layers on top, as numpy computes them."""
    weights, many = policy.weights, with_points(policy, n)
    for one in draws(n, rows=5):
        space = many.observations
        points = one[space.slice_of("points")].reshape(n, 2)
        points = points[one[space.slice_of("mask")] > 0.5]
        goal = np.concatenate([one[space.slice_of(name)] for name in ("goal", "velocity")])
        goal[3:] /= np.float32(np.pi / 3)
        gate = 1 / (1 + np.exp(-weights["gate.weight"] @ goal - weights["gate.bias"]))
        hidden = points @ weights["point.weight"].T + weights["point.bias"]
        hidden = np.where(hidden > 0, hidden, 0.01 * hidden) * gate
        x = (hidden @ weights["feature.weight"].T + weights["feature.bias"]).max(axis=0)
        x = np.concatenate([x, goal])
        for k in range(2):
            x = np.maximum(weights[f"layer{k}.weight"] @ x + weights[f"layer{k}.bias"], 0)
        x = weights["layer2.weight"] @ x + weights["layer2.bias"]
        np.testing.assert_allclose(many.best(one), np.tanh(x[:2]), atol=1e-5)


def changed(one, space, points, mask):
    found = one.copy()
    found[space.slice_of("points")] = points.ravel()
    found[space.slice_of("mask")] = mask
    return found


def test_the_order_of_the_points_is_nothing(policy):
    """A permutation of the points gives the same action to the bit, and permutes the support."""
    many, rng = with_points(policy, 200), np.random.default_rng(1)
    for one in draws(200):
        points = one[many.observations.slice_of("points")].reshape(-1, 2)
        mask = one[many.observations.slice_of("mask")]
        order = rng.permutation(200)
        other = changed(one, many.observations, points[order], mask[order])
        np.testing.assert_array_equal(many.act(other), many.act(one))
        np.testing.assert_array_equal(order[many.support_points(other)], many.support_points(one))


@pytest.mark.parametrize(("n", "is_masked"), [(50, True), (64, False)])
def test_copies_of_points_are_nothing(policy, n, is_masked):
    """Each point once, or each three times: the same action, and the first copy supports it."""
    once, thrice = with_points(policy, n), with_points(policy, 3 * n)
    for one in draws(n):
        if not is_masked:
            one[once.observations.slice_of("mask")] = 1
        points = one[once.observations.slice_of("points")].reshape(-1, 2)
        mask = one[once.observations.slice_of("mask")]
        other = np.zeros(thrice.observations.size, np.float32)
        for name in ("windows", "goal", "velocity"):
            other[thrice.observations.slice_of(name)] = one[once.observations.slice_of(name)]
        other = changed(other, thrice.observations, np.tile(points, (3, 1)), np.tile(mask, 3))
        np.testing.assert_array_equal(thrice.act(other), once.act(one))
        np.testing.assert_array_equal(thrice.support_points(other), once.support_points(one))


def test_masked_points_are_nothing(policy):
    """Whatever stands in a masked place, the action is the same, and it supports nothing."""
    rng = np.random.default_rng(2)
    for one in draws(30):
        space = policy.observations
        mask = one[space.slice_of("mask")]
        points = one[space.slice_of("points")].reshape(-1, 2).copy()
        points[mask == 0] = rng.uniform(-50, 50, ((mask == 0).sum(), 2))
        other = changed(one, space, points, mask)
        np.testing.assert_array_equal(policy.act(other), policy.act(one))
        assert (mask[policy.support_points(other)] == 1).all()


def test_no_point_at_all_is_open_space(policy):
    """Without a point that counts the action is that for one point infinitely far away."""
    for one in draws(30, rows=5):
        space = policy.observations
        nothing = changed(one, space, np.full((30, 2), 3.0), np.zeros(30))
        far = changed(one, space, np.zeros((30, 2)), np.eye(30)[4])
        np.testing.assert_array_equal(policy.act(nothing), policy.act(far))
        assert (policy.support_points(nothing) == -1).all()


def test_the_support_points_alone_decide(policy):
    """Without all other points the action is the same; without one that supports it, it differs."""
    many = with_points(policy, 400)
    for one in draws(400, rows=10):
        space = many.observations
        points = one[space.slice_of("points")].reshape(-1, 2)
        support = many.support_points(one)
        assert support.shape == (20,)
        only = np.zeros(400)
        only[support] = 1
        np.testing.assert_array_equal(many.act(changed(one, space, points, only)), many.act(one))
        without = one[space.slice_of("mask")].copy()
        without[support[0]] = 0
        assert (many.act(changed(one, space, points, without)) != many.act(one)).any()


def test_other_terms_are_ignored(policy):
    """The windows change nothing, and a space without windows or mask works too."""
    one = draws(30)[0]
    other = one.copy()
    other[policy.observations.slice_of("windows")] = 3.0
    np.testing.assert_array_equal(policy.act(other), policy.act(one))
    few = policy.observations.only(("points", "goal", "velocity"))
    bare = PointSetPolicy(policy.weights, few, ACTIONS)
    space = policy.observations
    whole = changed(one, space, one[space.slice_of("points")], np.ones(30))
    np.testing.assert_array_equal(
        bare.act(whole[space.columns(bare_names(few))]), policy.act(whole)
    )


def bare_names(space):
    return [term.name for term in space.terms]


def test_the_file_keeps_everything():
    """Weights, spaces and the names of the terms of g come back from the bytes."""
    policy = made(terms=("velocity",), n_features=5, width=8)
    again = policy_from_bytes(policy.to_bytes())
    assert isinstance(again, PointSetPolicy)
    assert (again.terms, again.info) == (("velocity",), {"k": 20})
    assert again.to_bytes() == policy.to_bytes()
    for one in draws(30, rows=5):
        np.testing.assert_array_equal(again.act(one), policy.act(one))


def test_many_rows_are_single_calls(policy):
    """Rows together give the bits of each alone, and each draws from its own generator."""
    rows = np.array(draws(30, rows=17))
    best = policy.best_many(rows)
    drawn = policy.explore_many(rows, [np.random.default_rng(k) for k in range(17)])
    for k, row in enumerate(rows):
        np.testing.assert_array_equal(best[k], policy.best(row))
        np.testing.assert_array_equal(drawn[k], policy.explore(row, np.random.default_rng(k)))
    assert policy.best_many(rows[:0]).shape == (0, 2)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_points_that_are_not_finite_are_refused(policy, bad):
    """NaN or infinity anywhere is an error, also for the support points."""
    one = draws(30)[0]
    one[5] = bad
    for call in (policy.act, policy.support_points):
        with pytest.raises(ValueError, match="observation: expected finite numbers"):
            call(one)


def test_another_number_of_points_is_refused(policy):
    """An observation of more points is an error."""
    with pytest.raises(ValueError, match="observation: expected shape"):
        policy.act(draws(31)[0])


@pytest.mark.parametrize(
    ("name", "shape", "message"),
    [
        ("gate.weight", (64, 4), "gate: expected weights"),
        ("feature.bias", (19,), "feature: expected weights"),
        ("layer0.weight", (16, 24), "layer0: expected weights"),
        ("layer2.weight", (3, 16), "layer2: expected weights"),
        ("point.weight", (63, 2), "point.weight: expected a multiple of 8 rows, got 63"),
        ("layer3.weight", (4, 4), "layers: expected"),
    ],
)
def test_layers_that_do_not_fit_are_refused(policy, name, shape, message):
    """Weights of another shape or without a partner are named."""
    weights = policy.tensors() | {name: np.zeros(shape, np.float32)}
    with pytest.raises(ValueError, match=message):
        PointSetPolicy(weights, policy.observations, ACTIONS)


def test_spaces_without_points_are_refused(policy):
    """A space without points, of points of three numbers or with a short mask is refused."""
    goal, velocity = (policy.observations.term(name) for name in ("goal", "velocity"))

    def term(name, shape):
        return ObservationTerm(name=name, shape=shape, low=-1, high=1, unit="")

    for terms, message in (
        ((), "expected a term 'points'"),
        ((term("points", (4, 3)),), r"points: expected shape \(n, 2\)"),
        ((term("points", (4, 2)), term("mask", (3,))), r"mask: expected shape \(4,\)"),
    ):
        space = ObservationSpec(terms=(*terms, goal, velocity))
        with pytest.raises(ValueError, match=message):
            PointSetPolicy(policy.weights, space, ACTIONS)
    one = ActionSpec(names=("angular",), low=(-1.0,), high=(1.0,), units=("rad/s",))
    with pytest.raises(ValueError, match="layer2: expected weights"):
        PointSetPolicy(policy.weights, policy.observations, one)
