"""``andabata evaluate``: options, one table, going on after a kill."""

import json

from andabata.app.cli import main


def test_the_command_prints_one_table_and_resumes(capsys, tmp_path):
    """The command's rows are the same after a kill in the second trial."""
    words = ["evaluate", "--world", "maze", "--controllers", "straight,oracle", "--trials", "2"]
    words += ["--workers", "1", "--set", "simulated_robot.plant=kinematic"]
    words += ["--set", "terminations.time_limit=30", "--json"]
    words += [
        "--set",
        "simulated_robot.sensing.scanner=horizontal",
        "--out",
        str(tmp_path / "eval"),
    ]

    def result():
        assert main(words) == 0
        out = capsys.readouterr().out
        assert out.count("\n") == 1  # One JSON object and nothing else.
        return json.loads(out)

    data = result()
    assert data["reality"] == "field"
    assert "perturbations" not in data
    assert set(data["rows"][0]) >= {
        *("controller", "world", "goal", "trials", "successes", "collisions", "tipovers"),
        *("timeouts", "stuck", "success_rate", "wilson_low", "wilson_high", "spl"),
        *("trespass_m", "distance_m", "mean_time_s", "steering_variation"),
    }
    assert {row["controller"] for row in data["rows"]} == {"straight", "oracle"}
    assert all({"cause", "count"} <= set(row) for row in data["failures"])
    journal = tmp_path / "eval/trials.jsonl"
    lines = journal.read_text().splitlines()
    journal.write_text("\n".join(lines[:2]) + "\n" + lines[2][:40])  # A kill in the second trial.
    assert result()["rows"] == data["rows"]


def test_disturbances_come_with_what_they_cost(capsys, tmp_path):
    """Rows have every arm, ``perturbations`` the differences, ``run.json`` the level."""
    words = ["evaluate", "--world", "maze", "--controllers", "straight", "--trials", "2"]
    words += ["--workers", "1", "--reality", "field", "--perturb", "latency=0.3", "--json"]
    words += ["--set", "simulated_robot.plant=kinematic", "--set", "terminations.time_limit=4"]
    words += ["--set", "simulated_robot.sensing.scanner=horizontal", "--out", str(tmp_path)]
    assert main(words) == 0
    data = json.loads(capsys.readouterr().out)
    names = {row["controller"] for row in data["rows"]}
    assert names == {"straight", "straight@latency=0.3"}
    (row,) = data["perturbations"]
    assert (row["disturbance"], row["strength"], row["trials"]) == ("latency", 0.3, 2)
    assert data["reality"] == "field"
    about = json.loads((tmp_path / "run.json").read_text())
    assert about["reality"] == "field"
    assert about["config"]["simulated_robot"]["reality"]["soft_iron"] == 0.03
