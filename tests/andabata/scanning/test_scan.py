"""Any cloud to a virtual scan: levelling, the robot's own body, labels, more sectors."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.app.cli import main
from andabata.records import topics
from andabata.records.bag_writers import open_writer
from andabata.records.messages import MessageBuilder
from tests.support.edited_bags import transforms
from traversability.cloud import PointCloud
from traversability.files import cloud_to_bytes


def sensor_cloud(pitch_deg=0.0, seed=0):
    """Flat ground 0.72 m under the sensor, a wall 4 m ahead and a mast of the robot's own."""
    rng = np.random.default_rng(seed)
    r, bearing = rng.uniform(0.75, 10, 30_000), rng.uniform(-np.pi, np.pi, 30_000)
    ground = np.column_stack([r * np.cos(bearing), r * np.sin(bearing), np.full(30_000, -0.72)])
    ground = ground[ground[:, 0] < 4.0]
    wall = np.column_stack(
        [np.full(4000, 4.0), rng.uniform(-3, 3, 4000), rng.uniform(-0.72, 1.0, 4000)]
    )
    mast = np.column_stack([rng.uniform(-1.0, -0.8, (500, 2)), rng.uniform(-0.7, 0.5, 500)])
    points = np.concatenate([ground, wall, mast]) + rng.normal(0, 0.01, (len(ground) + 4500, 3))
    return Rotation.from_euler("y", pitch_deg, degrees=True).apply(points).astype(np.float32)


def scan(capsys, tmp_path, points, *options, **columns):
    """Return the exit code and the JSON result of a scan of points."""
    path = tmp_path / "cloud.npz"
    path.write_bytes(cloud_to_bytes(PointCloud(points, "sensor", **columns)))
    code = main(["scan", str(path), "--picture", str(tmp_path / "s.png"), "--json", *options])
    out = capsys.readouterr().out
    return code, json.loads(out) if out else None


def ahead(data):
    """Return the range straight ahead."""
    n = len(data["ranges"])
    return data["ranges"][n // 2]


def test_the_wall_ends_the_sectors_ahead(capsys, tmp_path):
    """Sectors towards a wall end at it; level ground leads to no note."""
    code, data = scan(capsys, tmp_path, sensor_cloud())
    assert code == 0
    assert 2.0 < ahead(data) < 4.0
    assert data["notes"] == []
    assert data["ground_tilt_deg"] == pytest.approx(0.0, abs=0.5)
    assert "scores" not in data


def test_the_robots_own_mast_is_left_out_when_asked(capsys, tmp_path):
    """``--own-body`` removes the sensor's near returns and nothing else."""
    behind = 4  # The sector of bearing -129 degrees.
    _, seen = scan(capsys, tmp_path, sensor_cloud())
    _, spared = scan(capsys, tmp_path, sensor_cloud(), "--own-body", "1.6")
    assert seen["ranges"][behind] < 1.5
    assert spared["ranges"][behind] is None or spared["ranges"][behind] > 5.0
    assert 2.0 < ahead(spared) < 4.0


def test_a_pitched_sensor_is_noticed_and_can_be_levelled(capsys, tmp_path):
    """A tilt is noted; ``--level`` and ``--mounting`` undo it."""
    pitched = sensor_cloud(16.0)
    _, crooked = scan(capsys, tmp_path, pitched)
    assert "tilts 16 degrees" in " ".join(crooked["notes"])
    _, straight = scan(capsys, tmp_path, pitched, "--level")
    assert straight["notes"] == []
    assert 2.0 < ahead(straight) < 4.0
    _, mounted = scan(capsys, tmp_path, pitched, "--mounting", "0,0,0,-16,0")
    assert mounted["notes"] == []
    assert 2.0 < ahead(mounted) < 4.0


@pytest.mark.parametrize("sectors", [64, 128])
def test_more_ranges(capsys, tmp_path, sectors):
    """``--sectors`` sets the number of ranges."""
    _, data = scan(capsys, tmp_path, sensor_cloud(), "--sectors", str(sectors))
    assert len(data["ranges"]) == len(data["cell_states"]) == sectors
    assert 2.0 < ahead(data) < 4.0


def test_a_labelled_cloud_is_scored(capsys, tmp_path):
    """A labelled cloud is scored against its labels."""
    points = sensor_cloud()
    bad = points[:, 2] > -0.6
    _, data = scan(capsys, tmp_path, points, nontraversable=bad)
    assert data["scores"]["recall"] > 0.9
    assert data["scores"]["balanced_accuracy"] > 0.9


def test_one_place_and_far_points_are_unknown_and_never_free(capsys, tmp_path):
    """Without ground all ranges are unknown, and the exit code is 1."""
    for points in (np.full((200, 3), 2.0), np.full((200, 3), 1e30)):
        code, data = scan(capsys, tmp_path, points.astype(np.float32))
        assert code == 1  # No cell could be classified.
        assert sum(r is None for r in data["ranges"]) == 32
        assert (data["unknown_share"], data["nearest_obstacle_m"]) == (1.0, None)
        assert len(data["notes"]) == 1


@pytest.mark.parametrize(
    "options", [("--own-body", "9"), ("--sectors", "3"), ("--own-body", "4.9", "--level")]
)
def test_options_out_of_bounds_are_errors(capsys, tmp_path, options):
    """Options out of bounds are errors."""
    near = sensor_cloud()
    near = near[np.linalg.norm(near, axis=1) < 4.0]
    code, _ = scan(capsys, tmp_path, near, *options)
    assert code in (1, 2)


def test_an_empty_scan_has_a_note_on_its_cause(capsys, tmp_path):
    """Without a classified cell a note gives the cause."""
    seen = sensor_cloud()
    for points, words in (
        (seen * 1000, "look like millimetres, not metres: give --unit 0.001"),
        (seen * [1000, 1000, 0], "further than lasers reach: are the coordinates metres?"),
        (seen + np.float32([300, 5000, 0]), "--sensor-at X,Y,Z"),
        (seen + np.float32([25, 0, 0]), "expected points within 10 m, got the nearest"),
        (seen + np.float32([0, 0, 20]), "above the robot's height, up to 1.2 m over the ground"),
        (seen / 50, "nearer than the first ring"),
        (seen[::2500], "no cell holds 5 points"),
    ):
        code, data = scan(capsys, tmp_path, np.asarray(points, np.float32))
        assert words in " ".join(data["notes"])
        assert code == 1
        assert data["cells"]["green"] == data["cells"]["red"] == 0


def test_a_cloud_of_a_map_is_scanned_from_the_sensors_position(capsys, tmp_path):
    """``--sensor-at`` makes the sensor the origin of a map's cloud."""
    here = np.array([701_362.5, 4_485_513.25, 312.0])
    path = tmp_path / "map.npz"
    np.savez(path, sensor_cloud().astype(np.float64) + here)
    words = ["scan", str(path), "--picture", str(tmp_path / "s.png"), "--json"]
    assert main(words) == 1
    assert "nearest point is 4.5" in json.loads(capsys.readouterr().out)["notes"][0]
    assert main([*words, "--sensor-at", ",".join(map(str, here))]) == 0
    data = json.loads(capsys.readouterr().out)
    _, plain = scan(capsys, tmp_path, sensor_cloud())
    assert np.mean(np.array(data["cell_states"]) != np.array(plain["cell_states"])) < 0.01


def test_the_ground_shows_a_wrong_height_and_an_upside_down_sensor(capsys, tmp_path):
    """A wrong height and an upside-down sensor are noted with the option."""
    _, low = scan(capsys, tmp_path, sensor_cloud(), "--sensor-height", "1.7")
    assert "--sensor-height should be about 0.7" in " ".join(low["notes"])
    assert low["ground_height_m"] == pytest.approx(0.98, abs=0.03)
    _, turned = scan(capsys, tmp_path, sensor_cloud() * np.float32([1, -1, -1]))
    assert "mounted upside down?" in " ".join(turned["notes"])
    options = ("--mounting", "0,0,180,0,0")
    _, right = scan(capsys, tmp_path, sensor_cloud() * np.float32([1, -1, -1]), *options)
    assert right["notes"] == []


def test_a_body_that_shortens_sectors_is_noted_with_its_radius(capsys, tmp_path):
    """A note on the robot's own body names the radius to leave out."""
    rng = np.random.default_rng(1)
    post = np.column_stack(
        [rng.uniform(-0.8, -0.7, (300, 2)) * [1, 0.2], rng.uniform(-0.5, 0.3, 300)]
    )
    points = np.concatenate([sensor_cloud(), post]).astype(np.float32)
    _, seen = scan(capsys, tmp_path, points)
    assert "--own-body 1.0" in " ".join(seen["notes"])
    assert min(r for r in seen["ranges"] if r is not None) < 1.0
    _, spared = scan(capsys, tmp_path, points, "--own-body", "1.0")
    assert spared["notes"] == []


def test_unknown_sectors_are_counted_and_nothing_near_is_no_obstacle(capsys, tmp_path):
    """Half a cloud leaves half of the ranges unknown."""
    points = sensor_cloud()
    half = points[points[:, 0] < 0]
    half = half[np.linalg.norm(half, axis=1) > 1.6]
    path = tmp_path / "cloud.npz"
    path.write_bytes(cloud_to_bytes(PointCloud(half, "sensor")))
    assert main(["scan", str(path), "--picture", str(tmp_path / "s.png")]) == 0
    out = capsys.readouterr().out
    assert "no obstacle seen; 50 % of the ranges unknown" in out


def test_labels_that_cannot_be_read_give_exit_code_3(capsys, tmp_path):
    """Unreadable labels are noted, and the exit code is 3."""
    path = tmp_path / "cloud.npz"
    table = dict(zip("xyz", sensor_cloud().T, strict=True))
    np.savez(path, **table, label=np.linspace(0, 1, len(table["x"])))
    words = ["scan", str(path), "--picture", str(tmp_path / "s.png"), "--json"]
    assert main(words) == 3
    data = json.loads(capsys.readouterr().out)
    assert data["data_lost"]
    assert "field label" in data["notes"][0]


def test_a_file_that_cannot_be_read_leaves_the_others(capsys, tmp_path, monkeypatch):
    """One damaged file among several leaves the others scanned."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.npz").write_bytes(b"PK")
    (tmp_path / "good.npz").write_bytes(cloud_to_bytes(PointCloud(sensor_cloud(), "sensor")))
    assert main(["scan", "bad.npz", "good.npz", "--json"]) == 3
    scans = json.loads(capsys.readouterr().out)["scans"]
    assert "bad.npz: expected" in scans[0]["error"]
    assert scans[1]["cells"]["green"] > 0


def test_five_columns_are_inferred_or_given(capsys, tmp_path):
    """Five columns of a bin file are inferred with a note, or given without."""
    points = sensor_cloud()
    ring = np.arange(len(points)) % 32
    rows = np.column_stack([points, ring * 3, ring]).astype("<f4")
    path = tmp_path / "five.pcd.bin"
    path.write_bytes(rows.tobytes())
    words = ["scan", str(path), "--picture", str(tmp_path / "s.png"), "--json"]
    assert main(words) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["columns"] == 5
    assert "5 columns, inferred from its content" in data["notes"]
    assert 2.0 < ahead(data) < 4.0
    assert main([*words, "--columns", "5"]) == 0
    assert json.loads(capsys.readouterr().out)["notes"] == []
    assert main(["clouds", "convert", str(path), str(tmp_path / "four.bin"), "--json"]) == 3
    assert json.loads(capsys.readouterr().out)["left_out"] == ["ring"]
    assert main(["clouds", "convert", str(path), str(tmp_path / "all.pcd"), "--json"]) == 0


def test_several_clouds_make_one_report(capsys, tmp_path, monkeypatch):
    """``--report`` puts the pictures of all clouds on one page."""
    monkeypatch.chdir(tmp_path)
    for name, pitch in (("level", 0.0), ("pitched", 16.0)):
        (tmp_path / f"{name}.npz").write_bytes(
            cloud_to_bytes(PointCloud(sensor_cloud(pitch), "sensor"))
        )
    assert main(["scan", "level.npz", "pitched.npz", "--report", "page.html", "--json"]) == 0
    scans = json.loads(capsys.readouterr().out)["scans"]
    assert [each["file"] for each in scans] == ["level.npz", "pitched.npz"]
    page = (tmp_path / "page.html").read_text()
    assert page.count("data:image/png;base64,") == 2
    assert "tilts 16 degrees" in page
    assert all((tmp_path / each["picture"]).exists() for each in scans)
    assert main(["scan", "level.npz", "pitched.npz", "--picture", "one.png"]) == 2


def bag_with(tmp_path, points, frame, *static):
    """Return a recording with one cloud, and transforms to its frame."""
    path = tmp_path / "cloud.bag"
    writer, builder = open_writer(path), MessageBuilder(1)
    for each in static:
        message = transforms(builder, "tf2_msgs/msg/TFMessage", each)
        writer.write(topics.TF_STATIC, builder.stamp_ns(2.0), message)  # After the cloud.
    message = builder.cloud(1.0, PointCloud(points, frame))
    writer.write(topics.CLOUD, builder.stamp_ns(1.0), message)
    writer.close()
    return path


def scan_bag(capsys, path, *options):
    """Return the JSON result of a scan of a recording."""
    words = ["scan", str(path), "--picture", str(path.with_suffix(".png")), "--json", *options]
    assert main(words) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(
    "frame", ["base_link", "/base_footprint", "husky1/base_footprint", "base_link/"]
)
def test_a_recorded_cloud_in_the_bodys_frame_is_not_lifted(capsys, tmp_path, frame):
    """A cloud in the robot's own frame takes no mounting but `laser=`."""
    points = sensor_cloud() + np.array([0, 0, 0.72], dtype=np.float32)
    path = bag_with(tmp_path, points, frame)
    data = scan_bag(capsys, path)
    assert 2.0 < ahead(data) < 4.0
    assert data["notes"] == []
    for options in (("--mounting", "0,0,0,0,0"), ("--sensor-height", "1.5")):
        again = scan_bag(capsys, path, *options)  # They are of a laser in a frame of its own.
        assert again["ranges"] == data["ranges"]
    raised = scan_bag(capsys, path, "--mounting", "laser=0,0,0.72,0,0,0")
    assert "the ground around the robot is at z = 0.70 m" in " ".join(raised["notes"])
    named = tmp_path / "cloud.npz"
    named.write_bytes(cloud_to_bytes(PointCloud(points, frame)))
    assert scan_bag(capsys, named)["ranges"] == data["ranges"]


def test_a_recorded_cloud_is_mounted_by_transforms_names_and_options(capsys, tmp_path):
    """A recorded cloud is placed by transforms, then frame names, then options."""
    straight = scan_bag(capsys, bag_with(tmp_path, sensor_cloud(), "velodyne"))
    assert "the pose of frame velodyne is unknown" in " ".join(straight["notes"])
    (tmp_path / "cloud.bag").unlink()
    backwards = sensor_cloud() * np.array([-1, -1, 1], dtype=np.float32)
    static = ("base_link", "laser", (0, 0, 0.72), (0, 0, 180))
    path = bag_with(tmp_path, backwards, "laser", static)
    data = scan_bag(capsys, path, "--sensor-height", "0.3")  # The transform knows better.
    assert data["ranges"] == straight["ranges"]
    assert data["notes"] == []
    path.unlink()
    path = bag_with(tmp_path, backwards, "os_lidar")
    data = scan_bag(capsys, path)
    assert data["ranges"] == straight["ranges"]
    assert "as its name says" in " ".join(data["notes"])
    given = scan_bag(capsys, path, "--mounting", "0,0,0,0,180")
    assert given["ranges"] == straight["ranges"]
    given = scan_bag(capsys, path, "--mounting", "0,0,0.72,0,0,180", "--sensor-height", "0.3")
    assert given["ranges"] == straight["ranges"]


@pytest.mark.parametrize("option", ["1,2,3", "imu=0,0,0,0,0", "0,0,0,0,x"])
def test_a_wrong_mounting_is_a_usage_error(capsys, tmp_path, option):
    """A text that is not a mounting is a usage error."""
    path = tmp_path / "cloud.npz"
    path.write_bytes(cloud_to_bytes(PointCloud(sensor_cloud(), "sensor")))
    assert main(["scan", str(path), "--mounting", option]) == 2
    assert "--mounting: expected" in capsys.readouterr().err
