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
