"""Each step that a note on a scan advises leads to the right ranges when it is followed."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.records import topics
from andabata.records.bag_writers import open_writer
from andabata.records.messages import MessageBuilder
from tests.support.scanned_scenes import advised, is_right, scan, scene, unpainted
from traversability.cloud import PointCloud
from traversability.files import cloud_to_bytes


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Draw nothing."""
    unpainted(monkeypatch)


def written(tmp_path, points, kind="npy", frame="sensor"):
    """Write a cloud of another program, or of our own, and return its path."""
    path = tmp_path / "cloud.npz"
    if kind == "npy":
        np.savez(path, np.asarray(points, dtype=np.float64))
    else:
        path.write_bytes(cloud_to_bytes(PointCloud(points.astype(np.float32), frame)))
    return path


def raised(*shift):
    """Return a scene's points in coordinates whose origin is elsewhere [m]."""
    return scene() + np.array(shift)


def turned(angles, points=None):
    """Return a scene's points in axes of which ``--mounting`` with these angles makes the robot's.

    Args:
        angles: Roll, pitch and yaw [deg].
        points: Points [m]; None for those of the scene.
    """
    rotation = Rotation.from_euler("xyz", angles, degrees=True)
    return rotation.inv().apply(scene() if points is None else points)


def test_a_scene_as_it_should_be_has_no_note(capsys, tmp_path):
    """Where the mounting is right nothing is doubted."""
    result = scan(capsys, written(tmp_path, scene()))
    assert result["notes"] == []
    assert is_right(result)


@pytest.mark.parametrize("kind", ["npy", "own"])
@pytest.mark.parametrize("unit", [0.001, 0.01, 0.0254, 1000.0])
def test_the_advised_unit_is_right(capsys, tmp_path, unit, kind):
    """Coordinates in another unit are recognised by the height of the sensor over the ground."""
    path = written(tmp_path, scene() / unit, kind)
    note = scan(capsys, path)["notes"][-1]
    assert "the coordinates look like" in note
    result = scan(capsys, path, *advised(note, "--unit"))
    assert result["notes"] == []
    assert is_right(result)


def test_whole_numbers_name_the_option_too(capsys, tmp_path):
    """Whole numbers are taken as metres with a note, whose option is the way to another unit."""
    path = tmp_path / "cloud.npz"
    np.savez(path, (scene() * 1000).astype(np.int32))
    notes = scan(capsys, path)["notes"]
    assert "whole numbers (int32) taken as metres; if they are another unit" in notes[0]
    result = scan(capsys, path, *advised(notes[-1], "--unit"))
    assert result["notes"] == []
    assert is_right(result)


def test_feet_are_one_of_two_explanations(capsys, tmp_path):
    """A sensor 2.36 m up may be one on a truck, or the coordinates may be feet."""
    path = written(tmp_path, scene() / 0.3048)
    (note,) = scan(capsys, path)["notes"]
    assert float(advised(note, "--sensor-height")[1]) == pytest.approx(2.36, abs=0.1)
    assert is_right(scan(capsys, path, *advised(note, "--unit")))
    truck = written(tmp_path, scene(height=1.5))
    (note,) = scan(capsys, truck)["notes"]
    assert "feet" not in note
    for step in (advised(note, "--sensor-height"), ["--level"]):
        result = scan(capsys, truck, *step)
        assert result["notes"] == []
        assert is_right(result)


def test_the_advised_height_is_that_of_the_mounting(capsys, tmp_path):
    """A Z in ``--mounting`` counts, not ``--sensor-height``: the note says so."""
    path = written(tmp_path, scene())
    (note,) = scan(capsys, path, "--mounting", "0,0,1.7,0,0,0")["notes"]
    assert "(Z in --mounting if it has one)" in note
    height = advised(note, "--sensor-height")[1]
    assert is_right(scan(capsys, path, "--mounting", f"0,0,{height},0,0,0"))


@pytest.mark.parametrize(
    ("angles", "words"),
    [
        ((180, 0, 0), "upside down"),
        ((-90, 0, -90), "y axis point down"),
        ((90, 0, -90), "y axis point up"),
    ],
)
def test_the_advised_mounting_is_right(capsys, tmp_path, angles, words):
    """Axes of a sensor upside down, a camera or a screen are recognised by the ground."""
    path = written(tmp_path, turned(angles))
    note = scan(capsys, path)["notes"][0]
    assert words in note
    result = scan(capsys, path, *advised(note, "--mounting"))
    assert result["notes"] == []
    assert is_right(result)


@pytest.mark.parametrize(
    ("angles", "where"), [((-90, 0, 0), " where x is"), ((90, 0, 0), " where x is forward")]
)
def test_the_other_mounting_of_two_that_fit_is_right(capsys, tmp_path, angles, where):
    """Where the ground leaves the heading open, the note says which mounting is for which axes."""
    path = written(tmp_path, turned(angles))
    note = scan(capsys, path)["notes"][0]
    text = note.split(", --mounting")[1]
    assert where in text
    result = scan(capsys, path, *advised(f"--mounting{text}", "--mounting"))
    assert is_right(result)


@pytest.mark.parametrize("pitch", [14.0, 25.0, -20.0])
def test_a_tilted_cloud_is_levelled_or_mounted(capsys, tmp_path, pitch):
    """``--level`` is advised where it levels the ground; ``--mounting`` does so, too."""
    path = written(tmp_path, turned((0, pitch, 0)))
    (note,) = scan(capsys, path)["notes"]
    assert f"tilts {abs(pitch):.0f} degrees" in note
    assert "--mounting X,Y,ROLL,PITCH,YAW, --level" in note
    levelled = scan(capsys, path, "--level")
    assert levelled["notes"] == []
    assert levelled["ranges"][15] == pytest.approx(3.245, abs=0.01)
    assert is_right(scan(capsys, path, "--mounting", f"0,0,0,{pitch},0"))


def test_ground_far_from_the_origin_is_not_a_sensors_height(capsys, tmp_path):
    """Where no sensor can be at the origin, ``--sensor-at`` is advised, never ``--level``."""
    for shift in (300.0, 17.0, 0.72, -20.0):
        path = written(tmp_path, raised(0, 0, shift))
        (note,) = scan(capsys, path)["notes"]
        assert "--level" not in note
        step = advised(note, "--sensor-at")
        assert float(step[1].split(",")[2]) == pytest.approx(shift, abs=0.03)
        result = scan(capsys, path, *step)
        assert result["notes"] == []
        assert is_right(result)


def test_the_advised_position_is_in_the_clouds_own_axes(capsys, tmp_path):
    """Under a mounting with angles the height over the ground is not the cloud's z."""
    points = turned((0, 30, 0), raised(0, 0, 40.0))
    path = written(tmp_path, points)
    options = ("--mounting", "0,0,0,30,0")
    (note,) = scan(capsys, path, *options)["notes"]
    assert is_right(scan(capsys, path, *options, *advised(note, "--sensor-at")))


def test_a_height_that_is_off_moves_the_given_position(capsys, tmp_path):
    """The advised position keeps the x and y that the user gave."""
    path = written(tmp_path, raised(700_000, 4_000_000, 312))
    (note,) = scan(capsys, path, "--sensor-at", "700000,4000000,280")["notes"]
    step = advised(note, "--sensor-at")
    assert step[1].startswith("700000,4000000,31")
    assert is_right(scan(capsys, path, *step))


def test_a_base_on_the_ground_needs_no_height(capsys, tmp_path):
    """A cloud whose origin is on the ground is a map's or the robot's own base's."""
    path = written(tmp_path, raised(0, 0, 0.72))
    (note,) = scan(capsys, path)["notes"]
    assert is_right(scan(capsys, path, *advised(note, "--sensor-height")))


def test_a_base_frame_off_the_ground_is_levelled(capsys, tmp_path):
    """A cloud in the robot's own frame takes no height: ``--level`` and a laser's mounting do."""
    low = written(tmp_path, scene(), "own", "base_link")
    (note,) = scan(capsys, low)["notes"]
    assert note.endswith("(--level)")
    assert is_right(scan(capsys, low, "--level"))
    tilted = written(tmp_path, turned((0, 16, 0), raised(0, 0, 0.72)), "own", "base_link")
    (note,) = scan(capsys, tilted)["notes"]
    assert "--mounting laser=X,Y,Z,ROLL,PITCH,YAW, --level" in note
    assert is_right(scan(capsys, tilted, "--level"))
    assert is_right(scan(capsys, tilted, "--mounting", "laser=0,0,0,0,16,0"))


def test_fewer_sectors_are_advised_where_they_help(capsys, tmp_path):
    """A thin cloud fills the usual sectors, though not 360; a thinner one none, and it is said."""
    thin = written(tmp_path, scene()[::60])
    (note,) = scan(capsys, thin, "--sectors", "360")["notes"]
    result = scan(capsys, thin, *advised(note, "--sectors"))
    assert result["code"] == 0
    thinner = written(tmp_path, scene()[::3000])
    (note,) = scan(capsys, thinner, "--sectors", "360")["notes"]
    assert note.endswith("is the cloud thinned?")


def test_the_advised_radius_leaves_the_body_out(capsys, tmp_path):
    """Returns of the robot's own body are gone with the radius that the note names."""
    rng = np.random.default_rng(1)
    mast = np.column_stack([rng.uniform(-0.8, -0.7, 300), rng.uniform(-0.1, 0.1, 300)])
    mast = np.column_stack([mast, rng.uniform(-0.5, 0.3, 300)])
    path = written(tmp_path, np.concatenate([scene(), mast]))
    (note,) = scan(capsys, path)["notes"]
    result = scan(capsys, path, *advised(note, "--own-body"))
    assert result["notes"] == []
    assert is_right(result)


def test_the_advised_columns_are_read(capsys, tmp_path):
    """Where the content leaves the number of columns open, the option decides."""
    path = tmp_path / "cloud.bin"
    path.write_bytes(np.random.default_rng(0).normal(size=(60, 4)).astype("<f4").tobytes())
    assert "say which with --columns" in scan(capsys, path)["error"]
    result = scan(capsys, path, "--columns", "4")
    assert (result["points"], result["columns"]) == (60, 4)


def test_a_recorded_cloud_of_a_map_is_read_as_its_refusal_says(capsys, tmp_path):
    """A cloud in a frame of the world needs the sensor's position there, and its height."""
    path = tmp_path / "cloud.bag"
    writer, builder = open_writer(path), MessageBuilder(1)
    cloud = PointCloud(raised(30, -20, 5).astype(np.float32), "map")
    writer.write(topics.CLOUD, builder.stamp_ns(1.0), builder.cloud(1.0, cloud))
    writer.close()
    error = scan(capsys, path)["error"]
    assert "--sensor-at X,Y,Z with --mounting laser=0,0,HEIGHT,0,0,0" in error
    options = ("--sensor-at", "30,-20,5", "--mounting", "laser=0,0,0.72,0,0,0")
    result = scan(capsys, path, *options)
    assert result["notes"] == []
    assert is_right(result)
