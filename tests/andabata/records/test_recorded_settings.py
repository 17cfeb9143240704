"""Settings of recorded drives."""

import json

import pytest

from andabata.app.cli import main
from andabata.records import topics
from andabata.records.messages import MessageBuilder
from andabata.records.recorded_settings import parse_settings
from andabata.records.recorder import SETUP
from tests.support import computed_bags

COMPOSE = MessageBuilder(1)


def diagnostics(settings, key=SETUP):
    """Return diagnostics with settings, as text or to be written as JSON."""
    text = settings if isinstance(settings, str) else json.dumps(settings)
    return COMPOSE.diagnostics(0.0, 0, "begin", {"cloud": "none", key: text})


def test_settings_of_our_recordings_are_returned():
    """Keys and values are kept, whatever else the diagnostics hold."""
    settings = {"simulated_robot": {"plant": "bullet"}, "geofence": None, "controller": "straight"}
    assert parse_settings(diagnostics(settings)) == settings


@pytest.mark.parametrize("text", ["{", "[1]", "7", '"rig"'])
def test_other_texts_are_no_settings(text):
    """Diagnostics of another robot may use the same key for anything."""
    assert parse_settings(diagnostics(text)) == {}
    assert parse_settings(diagnostics({"simulated_robot": {}}, "other")) == {}


def recording(folder, settings):
    """Return a recording of three seconds that begins with settings."""
    rows = computed_bags.drive(3.0)
    begin = diagnostics({"simulated_robot": settings})
    kind, stamp = topics.DIAGNOSTICS.kind, rows[0].stamp_ns
    rows.append(computed_bags.Row("/diagnostics", kind, stamp, begin))
    return computed_bags.write(folder / "x.bag", rows)


def test_settings_of_another_version_are_refused(tmp_path, capsys):
    """A field that this version does not know is named, before defaults are used in its place."""
    path = recording(tmp_path, {"plant": "kinematic", "haste": 1.0})
    assert main(["bag", "replay", str(path)]) == 1
    text = " ".join(capsys.readouterr().err.split())
    assert "expected settings of this version in the diagnostics, got simulated_robot.haste" in text
    assert "record it again" in text
    assert main(["bag", "replay", str(recording(tmp_path, {"plant": "kinematic"}))]) == 0


def test_a_copy_without_the_topic_is_replayed(tmp_path, capsys):
    """The next step that the error names is a real one."""
    path = computed_bags.write(tmp_path / "copy.bag", computed_bags.drive(4.0))
    assert main(["bag", "replay", str(path), "--controller", "straight", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["controller"] == "straight"
