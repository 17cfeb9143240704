"""``andabata policy distill``: a tiny distillation, its files, its result."""

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
    assert "expected a distillation with these settings" in capsys.readouterr().err
