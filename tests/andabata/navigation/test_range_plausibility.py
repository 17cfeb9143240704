"""Plausibility of ranges: impossible numbers, and ground that moves away all at once."""

import numpy as np
import pytest

from andabata.machine.sensor_readings import Sweeps
from andabata.navigation.range_plausibility import RangePlausibility, has_impossible

HEIGHT, RATE = 0.72, 40.0
ELEVATIONS = np.linspace(-0.75 * np.pi, 0.75 * np.pi, 541).astype(np.float32)


def ground(number, scale=1.0, offset=0.0, relief=0.025, noise=0.03, bias=0.02, wall=np.inf):
    """Return the ranges of a sweep over rough ground.

    Args:
        number: Number of the sweep, its seed.
        scale: Factor of all ranges.
        offset: Addition to all ranges [m].
        relief: Standard deviation of the ground's height in a sweep [m].
        noise: That of a range [m].
        bias: That of an error of all ranges of a sweep [m].
        wall: Distance of a wall on one side [m].
    """
    rng = np.random.default_rng([number, 7])
    # The plane of the sweeps turns over ground that it meets beam by beam.
    height = HEIGHT + relief * np.sqrt(2) * np.sin(40 * ELEVATIONS + 0.3 * number)
    with np.errstate(divide="ignore"):
        ranges = np.where(np.cos(ELEVATIONS) < -0.02, -height / np.cos(ELEVATIONS), np.inf)
        away = np.where(ELEVATIONS > 0.1, wall / np.sin(ELEVATIONS), np.inf)
    ranges = np.minimum(ranges, away) + noise * rng.standard_normal(len(ranges))
    return ranges * scale + offset + bias * rng.standard_normal()


def feed(check, first, count, change=ground, gap=0.0, **options):
    """Give sweeps one by one; return whether they are doubted after each."""
    found = []
    for number in range(first, first + count):
        stamp = np.array([100.0 + gap + number / RATE])
        ranges = np.asarray(change(number, **options), dtype=np.float32)[None]
        sweeps = Sweeps(stamp, 0.02 * stamp, 0.9, 1e-5, ELEVATIONS, ranges)
        assert check.is_possible(sweeps)
        found.append(check.is_doubted)
    return found


def healthy():
    """Return a check of a laser that was well for ten seconds."""
    check = RangePlausibility()
    assert not any(feed(check, 0, 400))
    return check


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"scale": 1.2}, "longer all at once, by 0.2"),
        ({"scale": 0.8}, "shorter all at once, by 0.2"),
        ({"offset": 0.5}, "longer all at once, by 0.5"),
        ({"offset": -0.3}, "shorter all at once, by 0.3"),
    ],
)
def test_ground_that_moves_from_one_sweep_to_the_next_is_doubted(options, words):
    """With the second sweep, as long as it stays there, and not any more when it is back."""
    check = healthy()
    assert feed(check, 400, 400, **options) == [False] + [True] * 399
    assert words in check.warning(120.0)
    assert check.warning(120.0).endswith("for 10.0 s")
    assert not any(feed(check, 800, 200)[1:])


def test_one_sweep_that_differs_is_no_doubt():
    """The next one does not confirm it."""
    check = healthy()
    assert not any(feed(check, 400, 1, scale=1.3))
    assert not any(feed(check, 401, 40))
    assert not any(feed(check, 441, 1, scale=1.3) + feed(check, 442, 1, scale=0.7))
    assert not any(feed(check, 443, 40))


@pytest.mark.parametrize("scale", [0.95, 1.05])
def test_small_changes_are_errors_of_a_sweep(scale):
    """Ranges vary by a few per cent from sweep to sweep."""
    assert not any(feed(healthy(), 400, 200, scale=scale))


def test_a_wall_on_one_side_is_not_the_ground():
    """The plane of the sweeps turns past its edge: the beams of the other side stay."""
    check = healthy()
    assert not any(feed(check, 400, 40, wall=0.4))
    assert not any(feed(check, 440, 40))


def test_sweeps_that_do_not_follow_each_other_are_not_compared():
    """After a gap the robot may stand elsewhere."""
    check = healthy()
    assert not any(feed(check, 400, 40, gap=1.0, scale=1.2))


def test_a_doubt_whose_end_was_not_seen_ends_by_the_usual_distance():
    """The fault went while the laser was silent."""
    check = healthy()
    assert all(feed(check, 400, 40, scale=1.2)[1:])
    found = feed(check, 480, 120)
    assert found[0]
    assert not any(found[60:])


def test_a_doubt_does_not_end_by_itself():
    """Ranges that stay wrong for a minute do not become usual."""
    check = healthy()
    assert all(feed(check, 400, 2400, scale=1.2)[1:])


def test_after_a_reset_all_is_new():
    """Another drive."""
    check = healthy()
    assert feed(check, 400, 4, scale=1.2)[-1]
    check.reset()
    assert not check.is_doubted
    assert not any(feed(check, 404, 40, scale=1.2))


@pytest.mark.parametrize(
    "elevations",
    [np.linspace(-1.5, 1.5, 541), np.tile(ELEVATIONS, (1, 1))],
    ids=["no beam down", "beams that change"],
)
def test_without_fixed_beams_to_the_ground_nothing_is_compared(elevations):
    """Their numbers are still examined."""
    check = RangePlausibility()
    for number, scale in enumerate([1.0] * 10 + [2.0] * 10):
        stamp, ranges = np.array([number / RATE]), ground(number, scale).astype(np.float32)[None]
        sweeps = Sweeps(stamp, stamp, 0.9, 1e-5, elevations.astype(np.float32), ranges)
        assert check.is_possible(sweeps)
        assert not check.is_doubted
    assert not check.is_possible(Sweeps(stamp, stamp, 0.9, 1e-5, elevations, ranges * -1))


@pytest.mark.parametrize(
    ("bad", "share", "is_impossible"),
    [
        (np.nan, 0.9, False),
        (np.inf, 0.9, False),
        (-np.inf, 0.9, False),
        (1e30, 0.1, True),
        (-1e30, 0.1, True),
        (-1.0, 0.1, True),
        (-1.0, 0.02, False),
        (9e3, 0.9, False),
    ],
)
def test_numbers_that_no_laser_measures_are_impossible(bad, share, is_impossible):
    """No number and no return are possible, a few damaged ones too; and so does the check."""
    rows = np.full((3, 100), 5.0, dtype=np.float32)
    rows[1, : round(100 * share)] = bad
    assert has_impossible(rows, 0.0) == is_impossible
    stamps = np.arange(3) / RATE
    sweeps = Sweeps(stamps, stamps, 0.9, 1e-5, np.linspace(-2.3, 2.3, 100), rows)
    assert RangePlausibility().is_possible(sweeps) == (not is_impossible)


def test_coordinates_may_be_negative():
    """Points have no least number."""
    points = np.full((3, 3), -5.0, dtype=np.float32)
    assert not has_impossible(points, -np.inf)
    points[1, 2] = -1e5
    assert has_impossible(points, -np.inf)
