"""Training of classifiers: for the limit of plants that the clouds were labelled for."""

import pytest

from andabata.app.jobs.classifier_training import _with_limit_of
from traversability.dataset import Manifest, config_hash
from traversability.grid import PolarGrid


def manifest(limit):
    """Return a manifest of clouds for a robot with a limit of plants; None for one without."""
    robot = {} if limit is None else {"max_traversable_vegetation": limit}
    config = {"robot": robot}
    return Manifest(seed=0, config=config, config_sha256=config_hash(config), clouds=())


def test_the_grid_has_the_limit_of_the_clouds():
    """Clouds of versions before the limit count as those of the default."""
    grid = PolarGrid(n_sectors=16)
    found = _with_limit_of([manifest(0.3), manifest(0.3)], grid)
    assert found == PolarGrid(n_sectors=16, max_traversable_vegetation=0.3)
    assert _with_limit_of([manifest(None), manifest(0.15)], grid) == grid


def test_clouds_of_robots_with_different_limits_are_refused():
    """The message names both."""
    with pytest.raises(ValueError, match=r"got 0\.15 m, 0\.3 m; make them for one robot"):
        _with_limit_of([manifest(0.3), manifest(None)], PolarGrid())
