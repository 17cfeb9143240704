"""Reports of runs in rooms: which kind a folder is, pages with their pictures, and figures."""

import json

import pytest

from andabata.app.cli import main
from andabata.app.reports import run_folders, run_kind
from andabata.report.folder import RunFolderError
from tests.support.room_policies import point_policy


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Return a folder with two evaluations and a study of two seeds of a policy."""
    folder = tmp_path_factory.mktemp("runs")
    files = []
    for seed in (0, 1):
        files.append(folder / f"{seed}.safetensors")
        files[-1].write_bytes(point_policy(seed).to_bytes())
    some = ["--workers", "1", "--quiet", "--pairs", "2", "--policy", str(files[0])]
    both = [*some, "--policy", str(files[1])]
    rooms = ["--task", "spn", "--rooms", "env0,crowded,sudden", "--lidars", "ten-beams,hokuyo-270"]
    assert main(["evaluate", *rooms, *both, "--out", str(folder / "rooms")]) == 0
    blind = "--task spn --rooms env0 --lidars 180|90|5 --memory reactive --pairs 1"
    words = ["evaluate", *blind.split(), "--policy", "proportional", "--workers", "1", "--quiet"]
    assert main([*words, "--out", str(folder / "blind")]) == 0
    sets = [f"--set={name}=[]" for name in ("left", "turned", "fov_deg", "max_range")]
    study = ["lidar-study", *some, *sets, "--set=forward=[0.05]", "--set=resolution_deg=[90]"]
    assert main([*study, "--rooms", "random-1", "--out", str(folder / "study")]) == 0
    return folder


def report(capsys, *words):
    """Return the exit code, and the result or the error text."""
    capsys.readouterr()
    code = main(["report", *map(str, words), "--json", "--quiet"])
    printed = capsys.readouterr()
    return code, json.loads(printed.out) if code == 0 else printed.err


def test_an_evaluation_has_the_figures_of_the_paper(capsys, runs):
    """Ends, paths of each memory, support points, the tour and the sudden obstacles."""
    code, data = report(capsys, runs / "rooms")
    assert code == 0, data
    assert data["report"] == str(runs / "rooms/report.html")
    page = (runs / "rooms/report.html").read_text()
    captions = [part.split("<")[0] for part in page.split("<figcaption>")[1:]]
    assert captions == [
        "How drives ended (Fig. 8): 0, 1",
        "Paths and ends: 0, reactive",
        "Paths and ends: 0, with map",
        "0, ten-beams: the first drives in spn-env0, begun together",
        "Support points in spn-env0 (Fig. 6)",
        "Support points in spn-crowded (Fig. 6)",
        "Tour of spn-crowded (Fig. 10a)",
        "Obstacles that appear in spn-sudden (Fig. 10b)",
    ]
    assert len(data["rows"]) == 3 * 2 * 2 * 2
    assert len(data["pooled"]) == 3 * 2 * 2
    assert data["differences"] == []
    (tour,), (sudden,) = data["tours"], data["appearances"]
    assert (tour["room"], tour["goals"]) == ("spn-crowded", 5)
    assert set(tour["legs"]) == {"ten-beams, reactive", "ten-beams, with map"}
    assert all(len(drive["appear_after"]) == 2 for drive in sudden["drives"].values())


def test_a_policy_without_points_has_no_support_points(capsys, runs):
    """The page of the proportional controller has ends and paths alone."""
    code, data = report(capsys, runs / "blind", "--out", runs / "blind.html")
    assert (code, data["tours"], data["appearances"]) == (0, [], [])
    assert (runs / "blind.html").read_text().count("<figcaption") == 3


def test_a_study_has_differences_and_advice(capsys, runs):
    """The page gives the advice, the differences, and the paths of the best and the worst laser."""
    code, data = report(capsys, runs / "study")
    assert code == 0, data
    page = (runs / "study/report.html").read_text()
    assert data["advice"] in page
    assert page.count("<figcaption") == 4  # Differences, paths, film, support points.
    again = runs / "again.html"
    assert report(capsys, runs / "study", "--out", again)[0] == 0
    assert again.read_text() == page
    assert [row["text"] for row in data["rows"]] == [
        *("as it is", "0.05 m forward", "resolution 90 deg"),
    ]


def test_people_see_a_table_and_the_path(capsys, runs):
    """Without ``--json`` the table of the run is printed again, and the path of the page."""
    assert main(["report", str(runs / "study"), "--quiet"]) == 0
    out = capsys.readouterr().out
    assert "0.05 m forward" in out
    assert f"report: {runs / 'study/report.html'}" in out


def test_runs_of_other_kinds_are_not_mixed(capsys, runs):
    """Two kinds, and two evaluations, are refused."""
    code, error = report(capsys, runs / "rooms", runs / "study")
    assert code == 2
    assert "expected a run of `evaluate in rooms` as the first, got `lidar-study`" in error
    code, error = report(capsys, runs / "rooms", runs / "blind")
    assert (code, "expected one folder of `evaluate in rooms`, got 2" in error) == (2, True)


def test_a_damaged_folder_is_named(capsys, runs, tmp_path):
    """A run without its result, or with damaged drives, is an error with the file's name."""
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "run.json").write_bytes((runs / "blind/run.json").read_bytes())
    code, error = report(capsys, broken)
    assert (code, "evaluation.json: No such file" in error) == (1, True)
    (broken / "evaluation.json").write_bytes((runs / "blind/evaluation.json").read_bytes())
    for name in ("policies/0.safetensors", "drives/0.npz"):
        (broken / name).parent.mkdir()
        (broken / name).write_bytes((runs / "blind" / name).read_bytes()[:200])
    code, error = report(capsys, broken)
    assert code == 1
    (broken / "policies/0.safetensors").write_bytes(
        (runs / "blind/policies/0.safetensors").read_bytes()
    )
    code, error = report(capsys, broken)
    assert (code, "drives/0.npz: expected drives of andabata" in error) == (1, True)


def test_the_kind_of_a_run_is_told_by_its_description(tmp_path):
    """Training is told by the task of its stages, an evaluation by its task or its settings."""

    def kind(**about):
        (tmp_path / "run.json").write_text(json.dumps(about))
        return run_kind(tmp_path).name

    def stages(task):
        return {"stages": {"A": {"environment": {"task": task}}}}

    assert kind(verb="train", config=stages("spn")) == "train --task spn"
    assert kind(verb="train", config=stages("td3")) == "train --task td3"
    assert kind(verb="train", config=stages("offroad")) == "train"
    for task in ("spn", "td3"):
        assert kind(verb="evaluate", task=task) == "evaluate in rooms"
    assert kind(verb="evaluate", config={"simulated_robot": {}}) == "evaluate"
    assert kind(verb="evaluate", task="barn") == "evaluate --task barn"
    assert kind(verb="evaluate", config={"vehicle": {}}) == "evaluate --task barn"
    assert kind(verb="lidar-study", task="spn") == "lidar-study"
    assert kind(verb="drive") == "drive"
    assert kind(verb="classifier ground") == "classifier ground"
    with pytest.raises(RunFolderError, match=r"expected a run of clouds generate, .*'teleport'"):
        kind(verb="teleport")


def test_a_folder_of_seeds_stands_for_its_runs(tmp_path):
    """Folders of seeds come in the order of their numbers; a run stands for itself."""
    for name in ("seed-10", "seed-9", "other"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "run.json").touch()
    (tmp_path / "seed-11").mkdir()
    assert run_folders([tmp_path]) == [tmp_path / "seed-9", tmp_path / "seed-10"]
    assert run_folders([tmp_path / "seed-9"]) == [tmp_path / "seed-9"]
    (tmp_path / "run.json").touch()
    assert run_folders([tmp_path]) == [tmp_path]
    assert run_folders([tmp_path / "other"]) == [tmp_path / "other"]
