"""Peers label points; the bench scores everybody on the same clouds."""

import json

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.bench.perception_peers import PEERS
from andabata.datasets.hazard_suite import hazard_cases, hazard_cloud
from traversability.grid import PolarGrid
from traversability.height_rule import quantile_rule

GRID = PolarGrid()


def flat_with_post():
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-9, 9, (20_000, 2)), rng.normal(0, 0.01, 20_000)])
    post = (np.abs(points[:, :2] - [3.0, 1.0]) < 0.1).all(axis=1)
    points[post, 2] = rng.uniform(0.3, 1.0, post.sum())
    return points.astype(np.float32), post


def test_the_rule_finds_what_stands_on_its_cell():
    points, post = flat_with_post()
    flags = quantile_rule(0.15, 0.25, GRID)(points)
    np.testing.assert_array_equal(flags, post)


@pytest.mark.parametrize("peer", PEERS, ids=lambda peer: peer.name)
def test_each_peer_finds_a_post_on_flat_ground(peer, capfd):
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
    first, second = list(hazard_cases()), list(hazard_cases())
    assert first == second
    assert len({case.number for case in first}) == len(first)
    assert {case.slope_deg for case in first if case.hazard == "bare_ground"} >= {0.0, 19.5}
    case = first[5]
    np.testing.assert_array_equal(hazard_cloud(case).points, hazard_cloud(case).points)
    assert len(hazard_cloud(case, 1)) != len(hazard_cloud(case))


def test_the_bench_gives_a_row_for_each_figure(tmp_path, capsys):
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
