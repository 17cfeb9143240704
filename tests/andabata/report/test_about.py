"""Section on how runs were made: commands once, versions, settings, earlier versions."""

import json

from andabata.report.about import about_section
from andabata.report.blocks import Shown

ABOUT = {"verb": "drive", "seed": 7, "commit": "abc", "command": "andabata drive --seed 7"}
ABOUT |= {"python": "3.11.7", "versions": {"andabata": "0.1.0", "ray": None}}
ABOUT |= {"config": {"b": 1, "a": 2}, "config_sha256": "0123456789abcdef"}


def text_of(tmp_path, *abouts):
    """Return the section of runs with descriptions, and their folders."""
    folders = [tmp_path / str(number) for number in range(len(abouts))]
    for folder, about in zip(folders, abouts, strict=True):
        folder.mkdir()
        (folder / "run.json").write_text(json.dumps(about))
    return about_section(folders).to_html(Shown()), folders


def test_a_run_is_told_by_command_commit_seed_and_settings(tmp_path):
    """The settings' hash is short; packages that are missing have no row."""
    text, (folder,) = text_of(tmp_path, ABOUT)
    assert text.startswith('<h2 id="how-it-was-made">')
    row = (str(folder), "drive", "7", "abc", "0.1.0", "0123456789ab")
    assert all(f">{cell}</td>" in text for cell in row)
    assert "<pre>andabata drive --seed 7</pre>" in text
    versions = text.split("<summary>Versions</summary>")[1].split("</details>")[0]
    assert "python" in versions
    assert "3.11.7" in versions
    assert "ray" not in versions
    settings = text.split("<summary>Settings</summary>")[1]
    assert settings.index("&quot;a&quot;: 2") < settings.index("&quot;b&quot;: 1")


def test_several_runs_share_commands_and_show_the_first_ones_settings(tmp_path):
    """The same command is told once, another beside it."""
    text, folders = text_of(tmp_path, ABOUT, ABOUT, ABOUT | {"command": "andabata drive"})
    assert "<pre>andabata drive --seed 7\nandabata drive</pre>" in text
    assert f"<summary>Settings of {folders[0]}</summary>" in text
    assert all(str(folder) in text for folder in folders)


def test_a_run_of_an_earlier_version_says_so(tmp_path):
    """Without a command and versions on record."""
    text, _ = text_of(tmp_path, {"verb": "drive", "seed": 1, "config": {}})
    assert "The command is not on record" in text
    assert "Versions" not in text
