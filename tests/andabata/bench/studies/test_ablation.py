"""Ablation of features: groups exist, and thresholds are the best ones."""

from types import SimpleNamespace

import numpy as np
import pytest

from andabata.bench.studies import ablation
from andabata.bench.studies.ablation import GAPS, PLANES, RISES, VARIANTS, best_scores, features_at
from traversability.features import ALL_FEATURES, OWN_FEATURES


def test_groups_are_features_and_do_not_overlap():
    """A name that is not a feature would leave nothing out."""
    groups = [*PLANES, *GAPS, *RISES]
    assert len(set(groups)) == len(groups)
    assert set(groups) <= set(OWN_FEATURES)
    assert set(features_at(("nowhere",))) == set()


@pytest.mark.parametrize("name", VARIANTS)
def test_variants_leave_out_existing_features(name):
    """All but the first two have fewer features than the shipped forest."""
    config = VARIANTS[name]
    assert set(config.excluded_features) <= set(ALL_FEATURES)
    whole = name in ("all", "without the screen")
    assert (len(config.names) == len(ALL_FEATURES)) == whole


def test_scores_are_those_of_the_threshold_with_the_best_f1(monkeypatch):
    """A threshold of 0.5 would miss the cell at 0.4, one of 0.1 would call all blocked."""
    probability = np.array([0.1, 0.1, 0.1, 0.1, 0.1, 0.4, 0.55, 0.6])
    blocked = np.array([False, False, False, False, True, True, True, False])
    forest = SimpleNamespace(predict_proba=lambda features: probability)
    monkeypatch.setattr(ablation, "train_forest", lambda *_, **__: forest)
    test = SimpleNamespace(features=None, blocked=blocked, ring=np.array([0, 0, 0, 0, 9, 0, 0, 0]))
    scores = best_scores(VARIANTS["all"], None, test)
    # The best threshold calls the last three blocked: two hits, one miss, one false alarm.
    assert scores["F1"] == pytest.approx(4 / 6)
    assert scores["balanced accuracy"] == pytest.approx((2 / 3 + 4 / 5) / 2)
    assert scores["recall within 5 m"] == 1.0
