"""Demonstration: the whole chain, small."""

import json

from andabata.app.cli import main

SMALL = {"train": 2, "validation": 1, "trees": 4, "episodes": 2, "trials": 1, "time_limit": 4}


def test_the_demo_runs_from_nothing_to_its_report(capsys, tmp_path):
    """All parts run, and their figures are in the result, the page and the file."""
    words = [word for name, value in SMALL.items() for word in ("--set", f"{name}={value}")]
    out = ["--out", str(tmp_path / "demo")]
    code = main(["demo", *out, "--seed", "0", "--workers", "1", "--json", *words])
    captured = capsys.readouterr()
    assert code == 0, captured.err
    found = json.loads(captured.out)
    assert found["learning"]["episodes"] == 2
    assert {row["trials"] for row in found["evaluation"]} == {1}
    assert all(attempt["time_s"] <= 4.1 for attempt in found["drive"]["attempts"])
    page = (tmp_path / "demo/report.html").read_text()
    titles = (
        "A classifier of cells",
        "Learning to steer",
        "A drive",
        "Two controllers side by side",
    )
    assert [title for title in titles if title not in page] == []
    saved = json.loads((tmp_path / "demo/demo.json").read_text())
    assert saved["classifier"] == found["classifier"]
