"""Peers label points; all subjects are scored on the same clouds and hazards."""

import json

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.bench.perception import (
    OURS,
    score_rows,
    score_table,
    tune_peers,
    world_table,
)
from andabata.bench.perception_peers import PEERS, Peer
from andabata.datasets.hazard_suite import hazard_cases, hazard_cloud
from traversability.grid import PolarGrid
from traversability.height_rule import quantile_rule
from traversability.labels import nontraversable

GRID = PolarGrid()


def flat_with_post():
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-9, 9, (20_000, 2)), rng.normal(0, 0.01, 20_000)])
    post = (np.abs(points[:, :2] - [3.0, 1.0]) < 0.1).all(axis=1)
    points[post, 2] = rng.uniform(0.3, 1.0, post.sum())
    return points.astype(np.float32), post


def test_the_rule_finds_what_stands_on_its_cell():
    """A post on flat ground is labelled, and nothing else."""
    points, post = flat_with_post()
    flags = quantile_rule(0.15, 0.25, GRID)(points)
    np.testing.assert_array_equal(flags, post)


@pytest.mark.parametrize("peer", PEERS, ids=lambda peer: peer.name)
def test_each_peer_finds_a_post_on_flat_ground(peer, capfd):
    """Every combination of settings is listed once, and nothing is printed."""
    points, post = flat_with_post()
    settings = list(peer.settings())
    assert len(settings) == np.prod([len(values) for values in peer.choices.values()])
    try:
        method = peer.make(**settings[-1], grid=GRID)
    except ImportError:
        pytest.skip(f"{peer.name} is not installed (extra `peers`)")
    flags = method(points)
    assert flags[post].mean() > 0.5
    assert flags[~post].mean() < 0.1
    assert capfd.readouterr().out == ""


def test_the_suite_is_fixed_and_covers_every_distance():
    """Cases and their clouds repeat; another seed gives another cloud."""
    first, second = list(hazard_cases()), list(hazard_cases())
    assert first == second
    assert len({case.number for case in first}) == len(first)
    assert {case.slope_deg for case in first if case.hazard == "bare_ground"} >= {0.0, 19.5}
    case = first[5]
    np.testing.assert_array_equal(hazard_cloud(case).points, hazard_cloud(case).points)
    assert len(hazard_cloud(case, 1)) != len(hazard_cloud(case))


def test_the_bench_gives_a_row_for_each_score(tmp_path, capsys):
    """The verb's JSON has rows for the shipped classifier, a peer and the point classifier."""
    clouds = str(tmp_path / "clouds")
    small = ["--set", "patch_size=40", "--workers", "1", "--json"]
    counts = ["--train", "2", "--validation", "2"]
    assert main(["clouds", "generate", "--out", clouds, *counts, *small]) == 0
    capsys.readouterr()
    options = ["--tuning", "1", "--points", "2", "--sides", "0", "--workers", "1", "--json"]
    assert main(["bench", "perception", "--clouds", clouds, *options]) == 0
    data = json.loads(capsys.readouterr().out)
    rows = {(row["subject"], row["name"]): row for row in data["rows"]}
    assert rows["andabata", "ms"]["ratio_to_ours"] == 1.0
    assert {"name", "subject", "value", "unit", "ratio_to_ours", "runs"} == set(data["rows"][0])
    assert ("quantile rule", "f1_red") in rows
    assert ("point classifier", "f1_points") in rows


def subject(value, ms, **more):
    """Return scores of a subject."""
    scores = {"balanced_accuracy": value, "f1_red": value / 2, "recall": value / 4, "ms": ms}
    confusion = {"tp": 1, "tn": 2, "fp": 3, "fn": 4}
    return scores | {"confusion": confusion, "worlds": {"maze": 0.5, "hill": 0.25}} | more


def test_ratios_are_of_our_scores_where_we_have_one():
    """A peer's points have no ratio, since the cell classifier labels none."""
    rows = score_rows({OURS: subject(0.8, 2.0), "peer": subject(0.4, 8.0, f1_points=0.3)})
    found = {(row["subject"], row["name"]): row for row in rows}
    assert found["peer", "ms"]["ratio_to_ours"] == 4.0
    assert found["peer", "ms"]["unit"] == "ms"
    assert found["peer", "f1_red"]["ratio_to_ours"] == 0.5
    assert found["peer", "f1_points"]["ratio_to_ours"] is None
    assert (OURS, "f1_points") not in found
    assert {row["runs"] for row in rows} == {10}


def test_tables_have_a_line_for_each_subject():
    """Worlds are columns in the order of their names; what a subject lacks is None."""
    scores = {OURS: subject(0.8, 2.0), "peer": subject(0.4, 8.0, f1_points=0.3)}
    assert [row["F1 of points"] for row in score_table(scores)] == [None, 0.3]
    assert score_table(scores)[1]["bal. accuracy"] == 0.4
    assert world_table(scores)[0] == {"subject": OURS, "hill": 0.25, "maze": 0.5}


def test_missing_peers_are_named_and_left_out(monkeypatch):
    """The others have the settings with the best F1."""

    def missing(grid):
        raise ModuleNotFoundError("no module", name="csf")

    cloud = hazard_cloud(next(case for case in hazard_cases() if case.hazard == "rock_field"))

    def rule(good, grid):
        return lambda points: nontraversable(cloud) == good

    peers = (Peer("absent", missing, {}), Peer("rule", rule, {"good": (False, True)}))
    monkeypatch.setattr("andabata.bench.perception.PEERS", peers)
    messages = []
    tuned = tune_peers([cloud], GRID, messages.append)
    assert tuned == (("rule", (("good", True),)),)
    assert messages[0] == "absent: left out, csf is not installed (extra `peers`)"
