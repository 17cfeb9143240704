"""Recordings from anywhere on Earth: datum, magnetic field, and wrong fixes."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.assembly.simulated_robot import with_geo_reference
from andabata.localization.datum import Datum
from andabata.machine.geo_reference import GeoReference
from andabata.machine.pose import Pose
from andabata.records import topics
from andabata.records.bag_writers import open_writer
from andabata.records.bags import Bag
from andabata.records.drive_setup import read_setup
from andabata.records.messages import MessageBuilder
from andabata.records.recorder import DATUM
from andabata.records.remarks import Remarks
from andabata.replay.datum import add_fix_remarks, given_geo_reference, position_fields
from tests.support.moved_drives import SENSORS, YEAR, copied, differing, moved, place, watched

DRIVE = ["drive", "--world", "natural-test", "--seed", "3", "--controller", "reactive"]
REPLAY = ["bag", "replay", "--controller", "reactive"]
PLACES = {
    "Waterloo": place(43.47, -80.54, 330.0),
    "Hobart": place(-42.88, 147.33, 50.0),
    "Taveuni, on the antimeridian": place(-16.8, 180.0, 40.0),
    "La Paz": place(-16.5, -68.15, 3640.0),
    "Longyearbyen": place(78.22, 15.65, 10.0),
}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A short drive with a 3D laser."""
    path = tmp_path_factory.mktemp("places") / "drive.bag"
    options = ["--out", str(path.parent / "out"), "--set", "plant=kinematic", "--no-clouds"]
    words = [*options, "--sensor", "vlp-16", "--time-limit", "8", "--record", str(path)]
    assert main([*DRIVE, *words, "--json", "--quiet"]) == 0
    return path


@pytest.fixture(scope="module")
def plain(recorded):
    """Its sensors' messages alone, as another robot would have recorded them."""
    return copied(recorded, recorded.with_name("plain.bag"))


@pytest.fixture(scope="module")
def plain_scans(plain):
    """What a replay of them makes of it."""
    with watched(pytest.MonkeyPatch()) as scans:
        assert main([*REPLAY, str(plain), "--json", "--quiet"]) == 0
    return scans


@pytest.fixture
def replay(capsys, monkeypatch):
    """Replay a recording; return the exit code, the figures or the error, and the scans."""

    def run(path, *words):
        capsys.readouterr()
        with watched(monkeypatch) as scans:
            code = main([*REPLAY, str(path), *words, "--json", "--quiet"])
        out, err = capsys.readouterr()
        return code, json.loads(out) if out else err, scans

    return run


@pytest.mark.parametrize("name", PLACES)
def test_a_drive_makes_the_same_ranges_wherever_on_earth(
    replay, recorded, plain_scans, tmp_path, name
):
    """A drive that is moved to another place gives the same virtual scans."""
    there = PLACES[name]
    code, data, others = replay(moved(recorded, tmp_path / "moved.bag", there))
    assert code == 0
    assert data["datum"]["source"] == "the first good fix"
    assert there.distance(data["datum"]["latitude_deg"], data["datum"]["longitude_deg"]) < 30
    assert data["magnetic"]["declination_deg"] == pytest.approx(there.declination_deg, abs=0.02)
    assert data["magnetic"]["source"] == f"WMM2020 for {YEAR:.1f}"
    assert data["health"] == {"ok": len(others)}
    assert sum(scan is not None for scan in plain_scans) > 60
    assert differing(plain_scans, others) == 0


def edited_fixes(plain, path, edit):
    """Copy a recording; ``edit`` takes the number of a fix and its message."""
    count = iter(range(1000))

    def change(topic, message):
        return edit(next(count), message) if topic is topics.FIX else message

    return copied(plain, path, change)


def test_moved_fixes_alone_give_the_same_ranges_and_a_compass_remark(
    replay, plain, plain_scans, tmp_path
):
    """With fixes of another place the scans stay, and the deviating field is reported."""

    def to_canada(_, fix):
        east = -80.54 + (fix.longitude + 4.478) * 1.105
        return replace(fix, latitude=fix.latitude + 6.755, longitude=east)

    path = edited_fixes(plain, tmp_path / "canada.bag", to_canada)
    code, data, scans = replay(path)
    assert code == 0
    assert differing(plain_scans, scans) == 0
    assert data["magnetic"]["declination_deg"] == pytest.approx(-9.5, abs=0.1)
    assert data["magnetic"]["compass_inclination_deg"] < 60 < data["magnetic"]["inclination_deg"]
    assert main([*REPLAY, str(path), "--datum", "36.7,-4.4"]) == 1


def test_a_datum_elsewhere_is_refused_with_both_places_and_the_distance(replay, plain):
    """A given datum far from the fixes is an error that names both places."""
    code, error, _ = replay(plain, "--datum", "43.47,-80.54")
    assert code == 1
    assert "latitude 43.47000, longitude -80.54000 (given)" in error
    assert "latitude 36.71" in error
    assert "km away" in error
    assert "--datum" in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    "words",
    [
        ["--datum", "36.71,-4.47"],
        [
            "--set",
            "sensing.geo_reference.latitude_deg=36.71",
            "--set",
            "sensing.geo_reference.longitude_deg=-4.47",
        ],
        ["--datum", "36.71,-4.47,25"],
    ],
)
def test_a_datum_that_is_given_is_the_origin(replay, plain, plain_scans, words):
    """A given datum becomes the origin, by option or by settings."""
    code, data, scans = replay(plain, *words, "--set", "sensing.geo_reference.declination_deg=4")
    assert code == 0
    assert data["datum"]["source"] == "given"
    assert data["datum"]["latitude_deg"] == 36.71
    assert data["magnetic"]["declination_deg"] == 4
    assert data["magnetic"]["source"].startswith("given (declination_deg); WMM2020")
    assert data["health"] == {"ok": len(scans)}
    assert differing(plain_scans, scans) == 0


def test_an_incomplete_or_invalid_datum_is_a_usage_error(replay, plain):
    """Half a datum and invalid texts are refused."""
    code, error, _ = replay(plain, "--set", "sensing.geo_reference.latitude_deg=36.71")
    assert code == 1
    assert "longitude_deg" in error
    for text in ("36.7", "91,0", "1,2,3,4", "north,0", "0,nan"):
        code, error, _ = replay(plain, "--datum", text)
        assert code == 2
        assert f"got {text!r}" in error


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"latitude": 0.0, "longitude": 0.0}, "at latitude 0, longitude 0"),
        ({"latitude": np.nan}, "a place that is no number"),
        ({"altitude": 1e6}, "altitude outside of -500 to 9000 m"),
        ({"latitude": 36.77}, "more than 1 km from the others"),
        ({"latitude": -4.478, "longitude": 36.715}, "more than 1 km from the others"),
        ({"latitude": 140.0, "longitude": 36.715}, "latitude beyond 90 degrees"),
        ({"position_covariance": -np.eye(3).ravel()}, "a negative variance"),
        ({"position_covariance": 1e9 * np.eye(3).ravel()}, "a standard deviation beyond 1000 m"),
    ],
)
def test_bad_fixes_at_the_begin_are_no_datum_and_are_counted(plain, tmp_path, change, reason):
    """Implausible first fixes are refused by reason, and a later one is the datum."""
    path = edited_fixes(
        plain, tmp_path / "x.bag", lambda k, fix: replace(fix, **change) if k < 3 else fix
    )
    with Bag(path) as bag:
        setup = read_setup(bag, {}, {})
    assert GeoReference().distance(*place_of(setup.datum)) < 30
    assert [n for text, n in setup.refused.items() if reason in text] == [3]
    assert np.hypot(*setup.start.position[:2]) < 5
    assert setup.is_rough


def test_a_receiver_without_a_fix_yet_is_waited_for(plain, tmp_path):
    """Messages without a fix before the first good one are skipped silently."""

    def late(k, fix):
        return replace(fix, status=replace(fix.status, status=-1), latitude=0.0) if k < 3 else fix

    with Bag(edited_fixes(plain, tmp_path / "x.bag", late)) as bag:
        setup = read_setup(bag, {}, {})
    assert GeoReference().distance(*place_of(setup.datum)) < 30
    assert not setup.refused


def test_a_recording_of_bad_fixes_alone_is_an_error_with_reasons(replay, plain, tmp_path):
    """Without any good fix the error names why the fixes were refused."""
    nowhere = edited_fixes(
        plain, tmp_path / "x.bag", lambda _, fix: replace(fix, latitude=0.0, longitude=0.0)
    )
    code, error, _ = replay(nowhere)
    assert code == 1
    assert "fixes at latitude 0, longitude 0" in error


@pytest.mark.parametrize(
    "change",
    [
        {"altitude": np.nan},
        {"position_covariance": np.full(9, np.nan)},
        {"position_covariance": np.zeros(9)},
        {"position_covariance_type": 0},
    ],
)
def test_unknown_altitude_and_variance_are_assumed_and_reported(
    replay, plain, plain_scans, tmp_path, change
):
    """Fixes without altitude or variance are used, and each assumption is counted."""
    path = edited_fixes(plain, tmp_path / "x.bag", lambda _, fix: replace(fix, **change))
    code, data, scans = replay(path)
    assert code == 0
    assert data["counts"]["gnss"][2] == 0
    assert data["counts"]["gnss"][0] > 0
    assumed = [remark["count"] for remark in data["remarks"] if remark["subject"] == "/fix"]
    assert sum(assumed) == sum(data["counts"]["gnss"])
    assert not data["refused_by_reason"]
    assert differing(plain_scans, scans) == 0


def test_later_bad_fixes_are_refused_by_reason(replay, plain, tmp_path):
    """Bad fixes after the start are refused, counted, and give exit code 3."""
    path = edited_fixes(
        plain,
        tmp_path / "x.bag",
        lambda k, fix: replace(fix, latitude=0.0, longitude=0.0) if k in (3, 5) else fix,
    )
    code, data, _ = replay(path)
    assert code == 3
    assert list(data["refused_by_reason"]["/fix"].values()) == [2]
    assert data["counts"]["gnss"][2] == 2


def test_a_given_start_keeps_its_position_in_the_map(plain, recorded, tmp_path):
    """With an /initialpose at (100, -50) the datum is laid such that the first fix is there."""
    path = tmp_path / "given.bag"
    writer, builder = open_writer(path), MessageBuilder(1)
    pose = Pose.from_euler(np.array([100.0, -50.0, 2.0]), 0.0, 0.0, 0.3)
    with Bag(plain) as bag:
        begin = next(bag.messages((topics.IMU.ros1,))).stamp_ns
        initial = replace(builder, epoch_ns=begin).stamped_pose(0.0, pose)
        writer.write(topics.INITIAL_POSE, begin, initial)
        for message in bag.messages():
            writer.write(SENSORS[message.topic], message.stamp_ns, message.content)
    writer.close()
    with Bag(path) as bag:
        setup = read_setup(bag, {}, {})
    first = GeoReference().to_geodetic(np.zeros((1, 3)))
    assert not setup.is_rough
    assert setup.datum.source == "the first good fix, at the given start"
    np.testing.assert_allclose(setup.datum.reference.to_map(first)[0, :2], [100, -50], atol=25)
    assert setup.datum.measured is not None


def test_a_pose_in_odom_is_no_start(plain, tmp_path):
    """An /odometry/filtered in ``odom``, as robot_localization's, gives no start."""
    path = tmp_path / "odom.bag"
    writer = open_writer(path)
    pose = Pose.from_euler(np.array([5e5, 4e6, 0.0]), 0.0, 0.0, 0.3)
    with Bag(plain) as bag:
        for k, message in enumerate(bag.messages()):
            if k % 200 == 0:
                odometry = replace(MessageBuilder(1), epoch_ns=message.stamp_ns).odometry(0.0, pose)
                header = replace(odometry.header, frame_id="odom")
                writer.write(
                    topics.FILTERED_ODOMETRY, message.stamp_ns, replace(odometry, header=header)
                )
            writer.write(SENSORS[message.topic], message.stamp_ns, message.content)
    writer.close()
    with Bag(path) as bag, Bag(plain) as other:
        assert read_setup(bag, {}, {}).datum == read_setup(other, {}, {}).datum


def test_the_datum_of_a_live_navigator_is_the_one_of_its_recording(plain, tmp_path):
    """The datum in a live navigator's diagnostics is the datum of its recording."""
    path, datum = tmp_path / "live.bag", Datum(PLACES["Hobart"], "the first good fix", "x", True)
    writer = open_writer(path)
    pose = Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.3)
    with Bag(plain) as bag:
        for k, message in enumerate(bag.messages()):
            if k % 200 == 0:
                builder = replace(MessageBuilder(1), epoch_ns=message.stamp_ns)
                values = {DATUM: json.dumps(datum.as_dict())} if k else {}
                diagnostics = builder.diagnostics(0.0, 0, "ok", values)
                writer.write(topics.DIAGNOSTICS, message.stamp_ns, diagnostics)
                writer.write(
                    topics.FILTERED_ODOMETRY, message.stamp_ns, builder.odometry(0.0, pose)
                )
            writer.write(SENSORS[message.topic], message.stamp_ns, message.content)
    writer.close()
    with Bag(path) as bag:
        setup = read_setup(bag, {}, {})
    assert setup.datum == replace(datum, source="the recording")
    assert not setup.is_rough


def test_our_own_recording_keeps_the_datum_of_its_settings(replay, recorded):
    """A recording of ours replays with the datum of its settings."""
    code, data, _ = replay(recorded)
    assert code == 0
    assert data["datum"] == {
        "latitude_deg": 36.715,
        "longitude_deg": -4.478,
        "altitude_m": 60.0,
        "source": "the recording",
    }
    assert data["magnetic"]["heading_only"] is False
    assert data["differing_scans"] == 0


def place_of(datum):
    """Return latitude and longitude of a datum [deg]."""
    return datum.reference.latitude_deg, datum.reference.longitude_deg


def test_the_fields_that_settings_fix_are_given():
    """Settings that change nothing give no field; those that fix one give it alone."""

    def fix_declination(base):
        site = base.sensing.geo_reference.model_copy(update={"declination_deg": 4.0})
        return with_geo_reference(base, site)

    assert given_geo_reference(lambda base: base) == {}
    assert given_geo_reference(fix_declination) == {"declination_deg": 4.0}
    full = given_geo_reference(lambda base: with_geo_reference(base, PLACES["Hobart"]))
    assert full == PLACES["Hobart"].model_dump()


def test_the_position_of_a_datum_is_what_later_pieces_use():
    """Position fields are latitude, longitude and, if known, altitude; no magnetic ones."""
    hobart = PLACES["Hobart"]
    position = {"latitude_deg": -42.88, "longitude_deg": 147.33, "altitude": 50.0}
    assert position_fields(Datum(hobart, "x", "x")) == position
    flat = hobart.model_copy(update={"altitude": None})
    assert set(position_fields(Datum(flat, "x", "x"))) == {"latitude_deg", "longitude_deg"}


def test_fixes_refused_before_and_after_the_start_add_up():
    """Refusals are summed by reason; assumptions are counted, and not as refusals."""
    remarks = Remarks()
    localizer = SimpleNamespace(rejected_fixes={"too far": 2}, assumed_fixes={"no altitude": 5})
    add_fix_remarks(remarks, localizer, {"too far": 1, "zeros": 4})
    assert remarks.refused_by_reason() == {"/fix": {"too far": 3, "zeros": 4}}
    assert {remark["text"]: remark["count"] for remark in remarks.as_dicts()}["no altitude"] == 5
