"""``andabata policy distill`` and ``imitate``: tiny ones, their files, their results."""

import json

from andabata.app.cli import main
from rl.policy import load_policy

TINY = (
    *("policy", "distill", "--workers", "1", "--seed", "5"),
    *("--set", "drives=[1]", "--set", "expert_shares=[1.0]", "--set", "hidden=[8]"),
    *("--set", "last_epochs=1", "--set", "driving.time_limit=0.3"),
)


def test_a_distillation_writes_its_policy(capsys, tmp_path):
    """The file drives, holds its settings, and a second call with another seed is refused."""
    out = tmp_path / "run"
    assert main([*TINY, "--out", str(out), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    policy = load_policy(out / "policy.safetensors")
    assert data["bytes"] == (out / "policy.safetensors").stat().st_size
    assert (policy.info["seed"], policy.info["config"]["hidden"]) == (5, [8])
    assert main([*TINY[:-1], "driving.time_limit=0.4", "--out", str(out)]) != 0
    assert "expected rounds with these settings" in capsys.readouterr().err


def test_an_imitation_writes_its_policy_which_drives(capsys, tmp_path):
    """One short drive is labelled; the policy drives as controller policy, with its own map."""
    out = tmp_path / "run"
    words = ["policy", "imitate", "--workers", "1", "--seed", "5", "--out", str(out), "--json"]
    for setting in ("drives=[1]", "teacher_shares=[1.0]", "hidden=[8]", "epochs=1"):
        words += ["--set", setting]
    words += ["--set", "driving.terminations.time_limit=6", "--set", "driving.goals=1"]
    assert main(words) == 0
    data = json.loads(capsys.readouterr().out)
    assert [one["round"] for one in data["rounds"]] == [0]
    picture = tmp_path / "decisions.png"
    for which in ("--worst", "--any"):
        words = ["policy", "decisions", str(out), "--out", str(picture), "--count", "2", which]
        assert main([*words, "--json"]) == 0
        drawn = json.loads(capsys.readouterr().out)
        assert drawn["decisions"] == data["rounds"][0]["labels"]
        assert drawn["shown"]
        assert 0.0 <= drawn["above_3_s"] <= drawn["above_1_s"] <= 1.0
        assert picture.read_bytes().startswith(b"\x89PNG")
    again = ["policy", "imitate", "--labels", str(out), "--out", str(tmp_path / "far"), "--json"]
    again += ["--set", 'reads=["map_far","goal"]']
    assert main(again) == 0
    fitted = json.loads(capsys.readouterr().out)
    assert load_policy(tmp_path / "far/policy.safetensors").terms == ("map_far", "goal")
    assert fitted["rounds"][0]["labels"] == data["rounds"][0]["labels"]
    drive = ["drive", "--world", "natural-test", "--seed", "7300", "--controller", "policy"]
    drive += ["--policy", data["policy"], "--set", "plant=kinematic", "--time-limit", "6"]
    assert main([*drive, "--out", str(tmp_path / "drive"), "--quiet", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["controller"] == "policy"
