"""Variations of clouds: cover on the ground, hidden directions, lost points."""

import numpy as np
import pytest

from andabata.datasets.cloud_variation import CloudVariation, _covered, _hidden, varied_cloud
from terrain.classes import SemanticClass
from traversability.cloud import PointCloud

LASER = np.array([0.0, 0.0, 1.0])


def test_a_cloud_of_the_robot_itself_stays_as_it_is():
    """Without a variation nothing is drawn and nothing changes."""
    cloud = PointCloud(np.ones((5, 3), dtype=np.float32))
    rng = np.random.default_rng(0)
    assert varied_cloud(cloud, CloudVariation(), LASER, rng) is cloud
    assert rng.bit_generator.state == np.random.default_rng(0).bit_generator.state


def test_points_are_kept_by_their_share():
    """The others are lost, with all that belongs to them."""
    points = np.arange(30_000, dtype=np.float32).reshape(-1, 3)
    cloud = PointCloud(points, severity=points[:, 0])
    found = varied_cloud(cloud, CloudVariation(kept=0.3), LASER, np.random.default_rng(0))
    assert len(found) == pytest.approx(3000, abs=150)
    np.testing.assert_array_equal(found.severity, found.points[:, 0])


def test_a_hidden_direction_is_one_narrow_wedge():
    """What one direction hides lies within 0.02 to 0.25 rad, also where bearings wrap."""
    bearings = np.linspace(-np.pi, np.pi, 7200, endpoint=False)
    circle = np.stack([np.cos(bearings), np.sin(bearings), 0 * bearings], axis=1)
    points = (6.0 * circle).astype(np.float32)
    widths, wrapped = [], 0
    for seed in range(1500):
        hidden = _hidden(points, 1, np.random.default_rng(seed))
        if not hidden.any():
            continue
        wrapped += bool(hidden[0] and hidden[-1])
        edges = int((hidden != np.roll(hidden, 1)).sum())
        assert edges == 2
        widths.append(hidden.mean() * 2 * np.pi)
    assert wrapped > 5
    assert min(widths) == pytest.approx(0.02, abs=0.005)
    assert max(widths) == pytest.approx(0.25, abs=0.005)


def test_litter_has_its_height_and_its_wavelengths():
    """Litter has the set root mean square, is smooth over 3 cm and independent over 2 m."""
    x, y = np.meshgrid(np.arange(0, 6, 0.03), np.arange(0, 6, 0.5), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1).astype(np.float32)
    high, bare = np.array([3.0, 3.0, 1e4]), np.ones(len(points), bool)
    tops = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        covered = _covered(points, bare, high, CloudVariation(litter=0.02), rng)
        np.testing.assert_allclose(covered[:, :2], points[:, :2], atol=1e-4)
        tops.append(covered[:, 2].reshape(x.shape))
    height = np.array(tops)
    assert height.std() == pytest.approx(0.02, rel=0.1)
    for steps, low, most in ((1, 0.95, 1.0), (5, 0.3, 0.9), (67, -0.15, 0.15)):
        kept = (height[:, steps:] * height[:, :-steps]).mean() / height.var()
        assert low < kept < most


def test_undulations_have_their_height_and_long_waves_are_the_higher_ones():
    """The set root mean square; half a metre apart more is kept than of litter."""
    x, y = np.meshgrid(np.arange(0, 6, 0.1), np.arange(0, 6, 0.5), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1).astype(np.float32)
    high, bare = np.array([3.0, 3.0, 1e4]), np.ones(len(points), bool)
    kept = {}
    for name in ("litter", "undulation"):
        cover = CloudVariation()._replace(**{name: 0.04})
        tops = np.array(
            [
                _covered(points, bare, high, cover, np.random.default_rng(seed))[:, 2]
                for seed in range(40)
            ]
        ).reshape(-1, *x.shape)
        assert tops.std() == pytest.approx(0.04, rel=0.1)
        kept[name] = (tops[:, 2:] * tops[:, :-2]).mean() / tops.var()
    assert kept["undulation"] > kept["litter"] + 0.1


def test_blades_are_as_high_over_a_slope_as_over_level_ground():
    """Seen at grazing angles up and down a slope, no point lies higher over it than the grass."""
    rng = np.random.default_rng(0)
    xy = rng.uniform(-9, 9, (4000, 2))
    xy = xy[np.hypot(*xy.T) > 1.0]
    points = np.column_stack([xy, 0.15 * xy[:, 0]]).astype(np.float32)
    laser, grass = np.array([0.0, 0.0, 0.4]), CloudVariation(grass=0.1)
    slopes = np.tile([0.15, 0.0], (len(points), 1))
    seen = 0.4 - points[:, 2] + (points[:, :2] * slopes).sum(axis=1) > 0.3
    covered = _covered(points, np.ones(len(points), bool), laser, grass, rng, slopes)
    over = covered[:, 2] - 0.15 * covered[:, 0]
    assert over[seen].min() > -1e-5
    assert 0.09 < over[seen].max() < 0.1 + 1e-5
    level = _covered(points, np.ones(len(points), bool), laser, grass, rng)
    assert (level[:, 2] - 0.15 * level[:, 0])[seen].max() > 0.11  # Without the slope it is not.


def test_tufts_leave_bare_ground_between_them_and_verges_leave_paths():
    """Among tufts some places have no blades; with a verge no point of a path moves."""
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-6, 6, (20_000, 2)), np.zeros(20_000)])
    points = points.astype(np.float32)
    high, bare = np.array([0.0, 0.0, 1e4]), np.ones(len(points), bool)
    cells = (np.floor(points[:, :2] / 0.3) + 20) @ [40, 1]

    def bare_cells(tufted):
        """Return the share of places of 0.3 m without a blade of 2 cm."""
        cover = CloudVariation(grass=0.15, tufted=tufted)
        tops = _covered(points, bare, high, cover, np.random.default_rng(1))[:, 2]
        return np.mean([tops[cells == cell].max() < 0.02 for cell in np.unique(cells)[::7]])

    assert bare_cells(tufted=True) > 0.05 > bare_cells(tufted=False)
    classes = np.where(points[:, 0] > 0, SemanticClass.PATH, SemanticClass.GROUND).astype(np.uint8)
    cloud = PointCloud(points, classes=classes)
    for verge in (True, False):
        cover = CloudVariation(grass=0.15, verge=verge)
        found = varied_cloud(cloud, cover, high, np.random.default_rng(2))
        moved = found.points[:, 2] > 0
        assert moved[points[:, 0] < 0].any()
        assert moved[points[:, 0] > 0].any() != verge


def test_cover_together_is_no_rougher_than_its_limit():
    """All three are scaled by one factor; smoother cover stays as it is."""
    rough = CloudVariation(grass=0.15, litter=0.02, undulation=0.05)
    scaled = rough.limited(0.03)
    total = np.sqrt(scaled.grass**2 / 12 + scaled.litter**2 + scaled.undulation**2)
    assert total == pytest.approx(0.03)
    assert scaled.grass / scaled.undulation == pytest.approx(3.0)
    assert rough.limited(0.2) == rough
    assert CloudVariation().limited(0.03) == CloudVariation()
