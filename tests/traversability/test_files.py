"""Clouds in and out of files: what is written comes back, what is damaged is refused politely."""

import struct

import numpy as np
import pytest

from tests.support.pcd_files import pcd_file
from traversability.arrays import ArrayFileError, pack, unpack
from traversability.class_table import load_class_table
from traversability.cloud import PointCloud
from traversability.files import (
    CloudFileError,
    cloud_to_bytes,
    columns_lost_by,
    decode_cloud_file,
    read_cloud,
)

RNG = np.random.default_rng(0)
POINTS = RNG.normal(size=(40, 3)).astype(np.float32)


def ply(form):
    """Return a PLY file of the points."""
    head = f"ply\nformat {form} 1.0\nelement vertex {len(POINTS)}\nproperty float x\n"
    head += "property double y\nproperty float z\nproperty uchar red\nend_header\n"
    if form == "ascii":
        rows = "".join(f"{x!r} {y!r} {z!r} 7\n" for x, y, z in POINTS.tolist())
        return (head + rows).encode()
    order = "<" if "little" in form else ">"
    rows = b"".join(struct.pack(f"{order}fdfB", *map(float, row), 7) for row in POINTS)
    return head.encode() + rows


def longest_match(data, k):
    """Return length and distance of the longest copy that LZF can make for the bytes from k on."""
    best = 0, 0
    for begin in range(max(k - 8192, 0), k):
        length = 0
        # A copy may overlap what it writes: a run is one byte and a copy of it.
        while length < min(264, len(data) - k) and data[begin + length] == data[k + length]:
            length += 1
        best = max(best, (length, k - begin))
    return best


def lzf(data):
    """Return an LZF stream with literals, and with references back wherever 3 bytes repeat."""
    out, k = b"", 0
    while k < len(data):
        length, back = longest_match(data, k)
        if length < 3:
            out += bytes([0, data[k]])
            k += 1
            continue
        high, low, more = (back - 1) >> 8, (back - 1) & 255, length - 2
        out += bytes([more << 5 | high, low] if more < 7 else [7 << 5 | high, more - 7, low])
        k += length
    return out


def pcd(form, points=POINTS):
    """Return a PCD file of points, with padding."""
    head = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z _ intensity\nSIZE 4 4 4 1 4\nTYPE F F F U F\n"
    head += f"COUNT 1 1 1 3 1\nWIDTH {len(points)}\nHEIGHT 1\nPOINTS {len(points)}\nDATA {form}\n"
    if form == "ascii":
        rows = "".join(f"{x!r} {y!r} {z!r} 0 0 0 0.5\n" for x, y, z in points.tolist())
        return (head + rows).encode()
    if form == "binary":
        rows = b"".join(struct.pack("<fff3xf", *map(float, row), 0.5) for row in points)
        return head.encode() + rows
    columns = [points[:, k].tobytes() for k in range(3)]
    columns += [bytes(3 * len(points)), np.full(len(points), 0.5, "<f4").tobytes()]
    flat = b"".join(columns)
    packed = lzf(flat)
    return head.encode() + struct.pack("<II", len(packed), len(flat)) + packed


def vtk():
    """Return a VTK file of the points."""
    head = (
        f"# vtk DataFile Version 3.0\ndata\nASCII\nDATASET POLYDATA\nPOINTS {len(POINTS)} float\n"
    )
    rows = "".join(f"{x!r} {y!r} {z!r} \n" for x, y, z in POINTS.tolist())
    return (head + rows + f"VERTICES {len(POINTS)} {2 * len(POINTS)}\n").encode()


def structured(path):
    """Return an npz file with a structured array."""
    fields = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("t", "<u4")]
    cloud = np.zeros(len(POINTS), dtype=fields)
    for k, name in enumerate("xyz"):
        cloud[name] = POINTS[:, k]
    np.savez(path, cloud=cloud)
    return path.read_bytes()


def files(tmp_path):
    """Return files of all kinds by name."""
    kitti = np.column_stack([POINTS, np.ones(len(POINTS), np.float32)]).astype("<f4").tobytes()
    own = PointCloud(
        POINTS,
        "base_footprint",
        np.arange(40.0),
        np.full(40, 3, np.uint8),
        np.arange(40) % 2 == 0,
    )
    return {
        "ascii.ply": ply("ascii"),
        "little.ply": ply("binary_little_endian"),
        "big.ply": ply("binary_big_endian"),
        "ascii.pcd": pcd("ascii"),
        "binary.pcd": pcd("binary"),
        "compressed.pcd": pcd("binary_compressed"),
        "cloud.vtk": vtk(),
        "cloud.bin": kitti,
        "structured.npz": structured(tmp_path / "s.npz"),
        "own.npz": cloud_to_bytes(own),
    }


NAMES = (
    "ascii.ply",
    "little.ply",
    "big.ply",
    "ascii.pcd",
    "binary.pcd",
    "compressed.pcd",
    "cloud.vtk",
    "cloud.bin",
    "structured.npz",
    "own.npz",
)


@pytest.mark.parametrize("name", NAMES)
def test_points_come_back(tmp_path, name):
    """All kinds of files hold the same points."""
    path = tmp_path / name
    path.write_bytes(files(tmp_path)[name])
    np.testing.assert_allclose(read_cloud(path).points, POINTS, rtol=1e-6)


def test_compressed_columns_may_repeat_what_stands_far_before(tmp_path):
    """z is x again: a reference back over more than one byte can count."""
    points = POINTS[:, [0, 1, 0]]
    path = tmp_path / "repeated.pcd"
    path.write_bytes(pcd("binary_compressed", points))
    np.testing.assert_array_equal(read_cloud(path).points, points)


def test_our_own_file_keeps_every_column_and_its_bytes(tmp_path):
    """Written again, it is the same file."""
    data = files(tmp_path)["own.npz"]
    path = tmp_path / "own.npz"
    path.write_bytes(data)
    cloud = read_cloud(path)
    assert cloud.frame == "base_footprint"
    assert cloud.nontraversable.sum() == 20
    assert cloud_to_bytes(cloud) == data


@pytest.mark.parametrize("name", NAMES)
def test_damaged_files_are_refused_or_read_but_never_crash(tmp_path, name):
    """Errors are one line with the file's name."""
    data = files(tmp_path)[name]
    rng = np.random.default_rng(len(name))
    path = tmp_path / f"damaged_{name}"
    for _ in range(120):
        spoilt = bytearray(data)
        if rng.random() < 0.4:
            spoilt = spoilt[: rng.integers(len(spoilt))]
        for _ in range(int(rng.integers(0, 6))):
            if spoilt:
                spoilt[rng.integers(min(len(spoilt), 300))] = rng.integers(256)
        path.write_bytes(bytes(spoilt))
        try:
            cloud = read_cloud(path)
        except CloudFileError as error:
            assert path.name in str(error)
            assert "\n" not in str(error)
        else:
            assert np.isfinite(cloud.points).all()


@pytest.mark.parametrize("name", ["empty.npz", "empty.ply", "empty.pcd", "empty.vtk", "empty.bin"])
def test_an_empty_file_is_named(tmp_path, name):
    """Whatever its kind."""
    (tmp_path / name).write_bytes(b"")
    with pytest.raises(CloudFileError, match=f"{name}: expected a point cloud, got an empty file"):
        read_cloud(tmp_path / name)


def test_no_returns_of_an_organised_cloud_are_left_out(tmp_path):
    """A file of nothing else is refused."""
    points = np.column_stack([POINTS, np.ones(40, np.float32)]).astype("<f4")
    points[::4, :3] = np.nan
    (tmp_path / "some.bin").write_bytes(points.tobytes())
    assert len(read_cloud(tmp_path / "some.bin")) == 30
    points[:, :3] = np.nan
    (tmp_path / "all.bin").write_bytes(points.tobytes())
    with pytest.raises(CloudFileError, match="expected finite points, got none among 40"):
        read_cloud(tmp_path / "all.bin")


def labelled():
    """Return a cloud with all columns."""
    severity = np.where(np.arange(40) % 3 == 0, np.float32(np.inf), np.float32(-2.5))
    return PointCloud(
        POINTS,
        "base_footprint",
        np.arange(40) * 0.125,
        (np.arange(40) % 16).astype(np.uint8),
        severity > 0,
        severity,
        np.arange(40) % 7 == 0,
    )


@pytest.mark.parametrize("kind", ["npz", "ply", "pcd", "las", "laz"])
def test_labels_and_stamps_are_kept(tmp_path, kind):
    """LAS has no room for some of the labels."""
    if kind in ("las", "laz"):
        pytest.importorskip("laspy", reason="laspy is not installed (extra `las`)")
    cloud, path = labelled(), tmp_path / f"cloud.{kind}"
    path.write_bytes(cloud_to_bytes(cloud, kind))
    again = read_cloud(path)
    np.testing.assert_allclose(again.points, cloud.points, atol=1e-4 if kind[0] == "l" else 0)
    np.testing.assert_allclose(again.stamps, cloud.stamps, atol=1e-9)
    np.testing.assert_array_equal(again.classes, cloud.classes)
    if kind[0] != "l":
        np.testing.assert_array_equal(again.nontraversable, cloud.nontraversable)
        np.testing.assert_array_equal(again.severity, cloud.severity)
        np.testing.assert_array_equal(again.forbidden, cloud.forbidden)


@pytest.mark.parametrize("name", ["label", "labels", "classification"])
@pytest.mark.parametrize("shape", [(40,), (40, 1)])
def test_labels_beside_bare_points_of_an_npz_file_are_scored(tmp_path, name, shape):
    """The table judges them; an array of another length is none of the points'."""
    classes = np.resize([40, 50], 40).astype(np.uint32)
    arrays = {"other": np.arange(7), name: classes.reshape(shape), "xyz": POINTS.astype(np.float64)}
    np.savez(tmp_path / "bare.npz", **arrays)
    table = load_class_table("semantickitti")
    decoded = decode_cloud_file(tmp_path / "bare.npz", labels=table)
    np.testing.assert_array_equal(decoded.cloud.classes, classes)
    np.testing.assert_array_equal(decoded.cloud.nontraversable, classes == 50)
    np.testing.assert_allclose(decoded.cloud.points, POINTS)
    assert "other" not in decoded.others


def test_labels_in_a_file_beside_an_npz_file_are_read(tmp_path):
    """NAME.label holds the class in its lower half; without any the step is named."""
    np.savez(tmp_path / "bare.npz", points=POINTS)
    table = load_class_table("semantickitti")
    with pytest.raises(CloudFileError, match=r"expected a column label.*or a file NAME\.label"):
        decode_cloud_file(tmp_path / "bare.npz", labels=table)
    classes = np.resize([40, 50], 40).astype("<u4")
    (tmp_path / "bare.label").write_bytes((classes | 3 << 16).tobytes())
    decoded = decode_cloud_file(tmp_path / "bare.npz", labels=table)
    np.testing.assert_array_equal(decoded.cloud.nontraversable, classes == 50)


def test_zeros_of_a_foreign_sensor_are_no_returns(tmp_path):
    """Every second slot is empty."""
    slots = np.zeros((130_000, 4), dtype="<f4")
    slots[1::2, :3] = np.resize(POINTS, (65_000, 3))
    (tmp_path / "slots.bin").write_bytes(slots.tobytes())
    assert len(read_cloud(tmp_path / "slots.bin")) == 65_000


def test_an_unknown_kind_and_a_missing_file_are_errors(tmp_path):
    """The error lists the known kinds."""
    (tmp_path / "cloud.docx").write_bytes(b"x")
    with pytest.raises(
        CloudFileError, match=r"expected a file of kind npz, ply, pcd, vtk, las, laz, bin"
    ):
        read_cloud(tmp_path / "cloud.docx")
    with pytest.raises(FileNotFoundError):
        read_cloud(tmp_path / "missing.npz")


def test_a_small_file_that_unpacks_into_too_much_is_refused():
    """Declared sizes are checked before anything is unpacked."""
    data = pack({"points": np.zeros((1_000_000, 3), dtype=np.float32)}, {})
    assert len(data) < 100_000
    with pytest.raises(ArrayFileError, match="expected at most 1000000 bytes unpacked"):
        unpack(data, 1_000_000)


def test_clouds_of_the_first_version_are_read(tmp_path):
    """Their stamps and severities are plain arrays; written anew, the cloud is the same."""
    count = len(POINTS)
    columns = {
        "points": np.asarray(POINTS, dtype=np.float32),
        "stamps": np.arange(count) * 1.7e-5,
        "severity": np.where(np.arange(count) % 3, np.inf, 0.25).astype(np.float32),
    }
    header = {"format": "andabata-cloud", "version": 1, "frame": "odom"}
    old = tmp_path / "cloud.npz"
    old.write_bytes(pack(columns, header))
    cloud = read_cloud(old)
    assert cloud.frame == "odom"
    for name, column in columns.items():
        assert getattr(cloud, name).tobytes() == column.tobytes()
    new = tmp_path / "new.npz"
    new.write_bytes(cloud_to_bytes(cloud))
    again = read_cloud(new)
    for name, column in columns.items():
        assert getattr(again, name).tobytes() == column.tobytes()


def test_a_pcds_viewpoint_is_kept_or_named_as_lost(tmp_path):
    """Coordinates stay in the file's frame; PCD keeps the pose, other formats name it."""
    path = tmp_path / "cloud.pcd"
    path.write_bytes(pcd_file(POINTS, "1 2 3 0 0 0 1"))
    found = decode_cloud_file(path)
    np.testing.assert_array_equal(found.cloud.points, POINTS)
    for kind in ("npz", "ply", "las", "bin"):
        assert columns_lost_by(kind, found) == ("VIEWPOINT",)
    assert columns_lost_by("pcd", found) == ()
    path.write_bytes(cloud_to_bytes(found.cloud, "pcd", viewpoint=found.viewpoint))
    again = decode_cloud_file(path)
    assert again.viewpoint.numbers == found.viewpoint.numbers == (1, 2, 3, 0, 0, 0, 1)
    np.testing.assert_array_equal(again.cloud.points, POINTS)


@pytest.mark.parametrize("name", NAMES)
def test_the_unit_that_the_user_gives_counts_for_every_kind(tmp_path, name):
    """All kinds of files become metres."""
    path = tmp_path / name
    path.write_bytes(files(tmp_path)[name])
    found = decode_cloud_file(path, unit=0.5)
    np.testing.assert_allclose(found.cloud.points, 0.5 * POINTS, rtol=1e-6)
    assert found.units.metres == (0.5, 0.5)
