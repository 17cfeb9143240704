"""Texts of options in rooms: names, labels, and errors that name the option."""

import shutil
from pathlib import Path

import pytest

import andabata.models
from andabata.app.cli import main
from andabata.app.options.room_words import (
    lidar_word,
    lidar_words,
    load_policies,
    memory_words,
    room_words,
)
from andabata.configuration.usage import UsageError
from andabata.machine.planar.lidar import PLANAR_LIDARS
from andabata.tasks.rooms.spn_config import SpnConfig
from rl.goal_laws import ProportionalPolicy
from rl.laws import LAWS, NULL_LAWS

SPN = SpnConfig()
OFFROAD = Path(andabata.models.__file__).parent / "policy.safetensors"


def test_rooms_of_the_family_may_be_short():
    """The family's name may be left out; random rooms go by their seed."""
    assert room_words("env4, spn-env5,crowded,random-12") == (
        *("spn-env4", "spn-env5", "spn-crowded", "random-12"),
    )


def test_families_have_short_names_of_their_own():
    """``env1`` is that of the task, ``gates`` all of its gates; full names stand for themselves."""
    gates = tuple(f"td3-gate-{width}" for width in ("060", "080", "100"))
    assert room_words("env1,bend,gates,clutter-7300,spn-env1", "td3") == (
        *("td3-env1", "td3-bend", *gates, "clutter-7300", "spn-env1"),
    )
    with pytest.raises(UsageError, match="got 'gates'"):
        room_words("gates", "spn")


@pytest.mark.parametrize("text", ["moon", "env9", "random-x", "env0,moon", "", " ,"])
def test_unknown_rooms_are_refused(text):
    """The error names the option and the rooms that there are."""
    with pytest.raises(UsageError, match=r"--rooms: expected .*spn-crowded, spn-env0"):
        room_words(text)


def test_lasers_are_names_and_labels():
    """``all`` are the seven of the comparison."""
    assert lidar_words("all") == tuple(PLANAR_LIDARS)
    assert lidar_words("trained,ten-beams") == ("trained", "ten-beams")
    with pytest.raises(UsageError, match="--lidar: expected one laser, got 'trained'"):
        lidar_word("trained")
    assert lidar_words("ten-beams, 180|20|10|0.05") == ("ten-beams", "180|20|10|0.05")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("radar", "expected FOV|RESOLUTION|RANGE"),
        ("180|20", "expected FOV|RESOLUTION|RANGE"),
        ("400|1|5", "fov_deg: input should be less than or equal to 360, got 400.0"),
        ("180|0|5", "resolution_deg: input should be greater than 0"),
        ("180|nan|5", "resolution_deg: "),
        ("", "expected all, names or labels of lasers, got nothing"),
    ],
)
def test_lasers_that_cannot_be_are_refused(text, message):
    """No beams, too wide a view, no number and unknown names are errors with the option's name."""
    with pytest.raises(UsageError) as caught:
        lidar_words(text)
    assert str(caught.value).startswith("--lidars: ")
    assert message in str(caught.value)


def test_memories_are_one_or_both():
    """``both`` are two columns of every table."""
    assert memory_words("both") == ("reactive", "map")
    assert memory_words("map") == ("map",)
    for text in ("none", "", "reactive,map"):
        with pytest.raises(UsageError, match="--memory: expected"):
            memory_words(text)


def _file(path):
    """Write a policy that drives in rooms."""
    task = SpnConfig()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(ProportionalPolicy({}, task.observations, task.actions).to_bytes())
    return str(path)


def test_policies_have_short_names_of_their_own(tmp_path):
    """A file's name is its stem, that of its folder where stems are alike, else its path."""
    one, two = (_file(tmp_path / f"seed-{k}/policy.safetensors") for k in (0, 1))
    assert list(load_policies([one, "proportional"], SPN)) == ["policy", "proportional"]
    assert list(load_policies([one, two, "proportional"], SPN)) == [
        "seed-0",
        "seed-1",
        "proportional",
    ]
    three = _file(tmp_path / "other/seed-0/policy.safetensors")
    assert list(load_policies([one, three], SPN)) == [one, three]


def test_null_controllers_have_a_word_of_their_own():
    """``nulls`` are all of the one list in its place; laws that are named come once."""
    assert list(load_policies(["shipped", "nulls"], SPN)) == ["shipped", *NULL_LAWS]
    rest = [name for name in NULL_LAWS if name != "heading"]
    assert list(load_policies(["nulls", "heading"], SPN)) == [*rest, "heading"]
    with pytest.raises(UsageError, match="expected each once, got nulls twice"):
        load_policies(["nulls", "nulls"], SPN)


def test_the_help_names_all_laws(capsys, monkeypatch):
    """Those of ``LAWS``, and after the word for them the null controllers in their order."""
    monkeypatch.setenv("COLUMNS", "2000")
    assert main(["evaluate", "--help"]) == 0
    text = capsys.readouterr().out
    assert all(f"`{name}`" in text for name in LAWS)
    assert f"null controllers: {', '.join(NULL_LAWS)}." in text


def test_policies_are_given_once_and_drive_in_rooms(tmp_path):
    """A policy twice, one of another kind and the shipped one while there is none are errors."""
    with pytest.raises(UsageError, match="--policy: expected each once, got proportional twice"):
        load_policies(["proportional", "proportional"], SPN)
    other = tmp_path / "other.safetensors"
    shutil.copy(OFFROAD, other)
    with pytest.raises(ValueError, match=r"other\.safetensors: policy: expected one that drives"):
        load_policies([str(other)], SPN)
    with pytest.raises(OSError, match="No such file"):
        load_policies(["missing.safetensors"], SPN)
