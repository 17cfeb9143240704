"""Report of evaluations off-road: tables, the paper's beside, failures with picture and cause."""

import json
import re
import shutil

import pytest

from andabata.report import evaluation
from andabata.report.evaluation import goals_table, report_evaluation
from tests.support.report_folders import written_evaluation


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return the folder of an evaluation."""
    return written_evaluation(tmp_path_factory.mktemp("runs") / "evaluation")


@pytest.fixture(scope="module")
def text(folder):
    """Return its page."""
    page, data = report_evaluation(folder)
    assert set(data) == {"rows", "failures"}
    return page.to_bytes().decode()


def test_the_title_counts_the_controllers(text):
    """Two are two; their names follow."""
    assert "<h1>Two controllers side by side</h1>" in text
    assert "planner, reactive; the same worlds" in text


def test_success_stands_with_its_interval(text):
    """Three of three goals in a row, and none of three; by world."""
    assert "<dt>planner, natural-test</dt><dd>3 of 3<small>1.00 [0.44, 1.00]" in text
    assert "<dt>reactive, natural-far</dt><dd>0 of 3<small>0.00 [0.00, 0.56]" in text
    table = text.split("<caption>natural-test</caption>")[1].split("</table>")[0]
    assert "way on forbidden ground [%]" in table
    assert "<td>3 of 3</td><td>1.00 [0.44, 1.00]</td>" in table


def test_collisions_with_movers_have_columns_where_there_were_any(folder):
    """Who drove into whom stands beside the collisions; without any there is no such column."""
    rows = json.loads((folder / "evaluation.json").read_text())["rows"]
    keys = ("collisions", "hit_mover", "hit_by_mover", "hit_at_rest")
    assert not set(keys[1:]) & set(goals_table(rows, "all").columns)
    shown = goals_table([row | {"hit_mover": 0, "hit_at_rest": 2} for row in rows], "all").columns
    first = shown.index("collisions")
    assert tuple(shown[first : first + 4]) == keys


def test_the_papers_table_stands_beside_its_world(text):
    """Table 4 is told, and drawn in natural-test."""
    assert "<td>98.0%</td><td>90.0%</td><td>70.0%</td>" in text
    assert "paper: Actor NN" in text


def test_difficulty_is_drawn_where_worlds_differ(text):
    """natural-far has three difficulties; its page has the section."""
    assert '<h2 id="difficulty">' in text


def test_failures_have_cause_and_picture(text):
    """They are counted by cause, shown, and listed."""
    failures = text.split('<h2 id="failures">')[1]
    row = '<td class="t">natural-test</td><td class="t">reactive</td><td class="t">collision</td>'
    assert f'{row}<td class="t">rock</td><td>3</td>' in failures
    assert "<summary>reactive: collision, rock (6)</summary>" in failures
    assert failures.count("data:image/webp") == 6
    assert "<summary>All 6 failed drives</summary>" in failures


def test_faults_have_a_table_for_each_controller(folder, text, tmp_path):
    """The robot without a fault comes first; an evaluation without faults has no section."""
    assert 'id="faults"' not in text
    own = tmp_path / "faulty"
    shutil.copytree(folder, own)
    row = {"controller": "planner", "fault": "", "trials": 3, "faulty": 3, "flagged": 0}
    row |= {"flagged_within_2_s": 0, "flagged_after_s": None, "contacts": 0}
    row |= {"contacts_after_flag": 0, "bad_commands": 0, "position_error_m": 0.5}
    row |= {"successes": 3, "difference": None, "difference_low": None, "difference_high": None}
    off = row | {"fault": "gnss:off@20", "flagged": 2, "flagged_after_s": 5.25}
    off |= {"difference": -0.5, "difference_low": -0.9, "difference_high": 0.1}
    data = json.loads((own / "evaluation.json").read_text())
    data["faults"] = [row, off, row | {"controller": "reactive"}]
    (own / "evaluation.json").write_text(json.dumps(data))
    page, shown = report_evaluation(own)
    section = page.to_bytes().decode().split('<h2 id="faults">')[1].split("<h2")[0]
    assert "in the same 3 trials" in section
    assert section.count("<caption>") == 2
    assert section.index("gnss:off@20") < section.index("<caption>reactive</caption>")
    assert "flagged after [s]" in section
    assert shown["faults"] == data["faults"]


def test_pictures_have_a_limit_and_the_rest_is_named(folder, monkeypatch):
    """What fits is shown; the page says where the others are."""
    shown = evaluation._pictures(folder / "failures", attempts(folder))
    size = len(next(iter(shown.values()))[0][1])
    monkeypatch.setattr(evaluation, "MOST_BYTES", round(2.5 * size))
    page, _ = report_evaluation(folder)
    text = page.to_bytes().decode()
    count = text.count("data:image/webp")
    assert 1 <= count <= 3
    assert f"{6 - count} more pictures are in {folder / 'failures'}" in text


def attempts(folder):
    """Return the attempts of the evaluation's journal."""
    return evaluation.read_attempts(folder / "trials.jsonl")


def test_every_group_of_failures_is_shown_before_any_has_two():
    """The first of each group comes first."""
    groups = {"a": [("1", b"xx"), ("2", b"xx")], "b": [("3", b"xx")]}
    found = evaluation._within(groups, 5)
    assert {name: len(some) for name, some in found.items()} == {"a": 1, "b": 1}


def test_a_trial_is_one_path_with_its_last_end(folder):
    """Attempts of a trial follow each other."""
    rows = [row for row in attempts(folder) if row["controller"] == "reactive"]
    joined = evaluation._joined(rows[:2])
    assert len(joined) == 1
    assert len(joined[0]["path"]) == 2 * (3 + 1)
    assert joined[0]["outcome"] == "collision"


def test_an_evaluation_without_its_journal_has_a_page(folder, tmp_path):
    """Tables are there; paths and pictures are not."""
    for name in ("run.json", "evaluation.json"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    page, _ = report_evaluation(tmp_path)
    text = page.to_bytes().decode()
    assert len(re.findall("<caption>", text)) == 2
    assert "data:image/webp" not in text


def test_pairs_stand_with_what_they_are_less(text):
    """The second controller less the first, over both worlds, and how often both have finished."""
    section = text.split("Pairs</h2>")[1].split("</section>")[0]
    assert "Each controller less planner, in the same 3 trials" in section
    assert "difference in success [points]" in section
    assert "p (McNemar)" in section
