"""Settings of recorded drives, of this version and of older ones."""

import json

import pytest

from andabata.app.cli import main
from andabata.records import topics
from andabata.records.bags import Bag, BagError
from andabata.records.drive_setup import read_setup
from andabata.records.messages import MessageBuilder
from andabata.records.recorded_settings import parse_settings
from andabata.records.recorder import SETUP
from tests.support import computed_bags

COMPOSE = MessageBuilder(1)
OLD = {
    "rig": {"plant": "kinematic", "local_map": {"cell": 0.1}, "sensing": {"site": {"field": 40.0}}},
    "area": [-1.0, -1.0, 1.0, 1.0],
    "controller": "learned",
    "models": {"squares": "1b53"},
}


def diagnostics(settings, key=SETUP):
    """Return diagnostics with settings, as text or to be written as JSON."""
    text = settings if isinstance(settings, str) else json.dumps(settings)
    return COMPOSE.diagnostics(0.0, 0, "begin", {"cloud": "none", key: text})


def test_settings_of_this_version_are_returned():
    """Keys and values are kept, whatever else the diagnostics hold."""
    settings = {"simulated_robot": {"plant": "bullet"}, "geofence": None, "controller": "straight"}
    assert parse_settings(diagnostics(settings), "x.bag") == settings


@pytest.mark.parametrize("text", ["{", "[1]", "7", '"rig"'])
def test_other_texts_are_no_settings(text):
    """Diagnostics of another robot may use the same key for anything."""
    assert parse_settings(diagnostics(text), "x.bag") == {}
    assert parse_settings(diagnostics({"rig": {}}, "other"), "x.bag") == {}


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"rig": {}}, [("rig", "simulated_robot")]),
        ({"area": None}, [("area", "geofence")]),
        ({"models": {"squares": ""}}, [("models.squares", "models.ground_classifier")]),
        (
            OLD,
            [
                ("rig.local_map", "simulated_robot.local_planner"),
                ("rig.sensing.site", "simulated_robot.sensing.geo_reference"),
            ],
        ),
    ],
)
def test_settings_of_an_older_version_are_refused(settings, words):
    """The error names each old key and its new name, and the next step."""
    with pytest.raises(BagError, match=r"x\.bag: expected settings of this version") as error:
        parse_settings(diagnostics(settings), "x.bag")
    for old, new in words:
        assert f"{old!r} (now {new!r})" in str(error.value)
    assert "record it again" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("learned", "policy+planner"),
        ("learned-map", "policy"),
        ("straight+map", "planner"),
        ("reactive+map", "reactive+planner"),
    ],
)
def test_the_controller_of_an_older_version_is_named_too(old, new):
    """A renamed controller is named beside the keys."""
    with pytest.raises(BagError) as error:
        parse_settings(diagnostics({"rig": {}, "controller": old}), "x.bag")
    assert f"the controller {old!r} (now {new!r})" in str(error.value)


def test_a_recording_of_an_older_version_is_not_replayed(tmp_path, capsys):
    """The survey and the setup both refuse it, before defaults are used."""
    rows = computed_bags.drive(3.0)
    begin = diagnostics(OLD)
    kind = topics.DIAGNOSTICS.kind
    rows.append(computed_bags.Row("/diagnostics", kind, rows[0].stamp_ns, begin))
    path = computed_bags.write(tmp_path / "old.bag", rows)
    assert main(["bag", "replay", str(path)]) == 1
    text = " ".join(capsys.readouterr().err.split())
    assert "expected settings of this version, got the keys 'rig' (now 'simulated_robot'), " in text
    with Bag(path) as bag, pytest.raises(BagError, match="/diagnostics: expected settings of this"):
        read_setup(bag, {}, {})


def test_a_copy_without_the_topic_is_replayed(tmp_path, capsys):
    """The next step that the error names is a real one."""
    path = computed_bags.write(tmp_path / "copy.bag", computed_bags.drive(4.0))
    assert main(["bag", "replay", str(path), "--controller", "straight", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["controller"] == "straight"
