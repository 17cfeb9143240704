"""Columns are decoded alike from every kind of file: no-returns, labels, far coordinates."""

import numpy as np
import pytest

from traversability.cloud import PointCloud, are_returns, joined
from traversability.decoding import decode_columns
from traversability.files import (
    CloudFileError,
    cloud_to_bytes,
    columns_lost_by,
    decode_cloud_file,
    read_cloud,
)
from traversability.formats import pcd, ply
from traversability.formats.error import FormatError

RNG = np.random.default_rng(0)
KINDS = ["npz", "ply", "pcd", "las", "laz"]
PLACES = {
    "utm": (701_362.56, 4_485_513.72, 312.345),
    "ecef": (4_071_000.123, -350_000.5, 4_880_000.25),
    "local": (12_345.6, 0.0, -3.0),
}


def far_cloud(place, count=400):
    """Return coordinates far from the origin, and their cloud."""
    coordinates = np.array(PLACES[place]) + np.round(RNG.uniform(-40, 40, (count, 3)), 3)
    return coordinates, PointCloud.from_coordinates(coordinates, "sensor")


def needs_laspy(kind):
    """Skip a test of LAS without laspy."""
    if kind in ("las", "laz"):
        pytest.importorskip("laspy", reason="laspy is not installed (extra `las`)")


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("kind", KINDS)
def test_far_coordinates_are_kept_to_a_millimetre_by_every_kind(tmp_path, kind, place):
    """Points stay near their origin in float32."""
    needs_laspy(kind)
    coordinates, cloud = far_cloud(place)
    assert cloud.points.dtype == np.float32
    assert np.abs(cloud.points).max() < 100
    path = tmp_path / f"far.{kind}"
    path.write_bytes(cloud_to_bytes(cloud, kind))
    again = decode_cloud_file(path).cloud
    assert np.abs(again.coordinates() - coordinates).max() < 1e-4


def test_near_coordinates_are_float32_as_they_were():
    """They need no origin."""
    points = RNG.normal(size=(20, 3)).astype(np.float32) * 100
    cloud = PointCloud.from_coordinates(points.astype(np.float64), "sensor")
    np.testing.assert_array_equal(cloud.points, points)
    assert not cloud.origin.any()


def test_a_kitti_file_refuses_far_coordinates():
    """The error names the kinds that hold them."""
    with pytest.raises(CloudFileError, match="write npz, ply, pcd or las"):
        cloud_to_bytes(far_cloud("utm")[1], "bin")


def test_las_comes_back_with_its_own_steps(tmp_path):
    """Whole numbers, scales and offsets are those of the first file."""
    laspy = pytest.importorskip("laspy", reason="laspy is not installed (extra `las`)")
    header = laspy.LasHeader(point_format=1, version="1.2")
    header.scales, header.offsets = [0.001, 0.01, 0.002], [701_000, 4_485_000, 0]
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = far_cloud("utm")[0].T
    cloud.intensity = np.arange(400)
    cloud.write(tmp_path / "one.las")
    decoded = decode_cloud_file(tmp_path / "one.las")
    data = cloud_to_bytes(decoded.cloud, "las", decoded.others, decoded.spacing)
    (tmp_path / "two.las").write_bytes(data)
    again = laspy.read(tmp_path / "two.las")
    for axis in "XYZ":
        np.testing.assert_array_equal(again[axis], cloud[axis])
    np.testing.assert_array_equal(again.header.scales, header.scales)
    np.testing.assert_array_equal(again.header.offsets, header.offsets)
    np.testing.assert_array_equal(again.intensity, cloud.intensity)


def test_a_cloud_wider_than_float32_has_a_remark_on_its_precision():
    """The remark names the precision of the farthest points."""
    coordinates = RNG.uniform(-60_000, 60_000, (100, 3)) + PLACES["utm"]
    table = dict(zip("xyz", coordinates.T, strict=True))
    assert "are kept to 0.00" in decode_columns(table).remarks[0]


@pytest.mark.parametrize("kind", ["npz", "ply", "pcd"])
def test_read_cloud_gives_far_coordinates_themselves(tmp_path, kind):
    """They are float64, and can be written again."""
    coordinates, cloud = far_cloud("utm")
    path = tmp_path / f"far.{kind}"
    path.write_bytes(cloud_to_bytes(cloud, kind))
    found = read_cloud(path)
    assert found.points.dtype == np.float64
    assert np.abs(found.points - coordinates).max() < 1e-4
    path.write_bytes(cloud_to_bytes(found, kind))
    assert np.abs(read_cloud(path).points - coordinates).max() < 1e-4


def test_parts_with_other_origins_are_not_joined():
    """Equal origins are."""
    with pytest.raises(ValueError, match="same origin"):
        joined([far_cloud("utm")[1], far_cloud("ecef")[1]])
    both = joined([far_cloud("utm")[1].select(np.arange(400) < 3)] * 2)
    assert (len(both), both.origin[0] > 7e5) == (6, True)


def spoilt():
    """Ten points, among them three no-returns."""
    points = RNG.normal(size=(10, 3)).astype(np.float32)
    points[2], points[5], points[7, 1] = 0.0, np.nan, np.inf
    return points


@pytest.mark.parametrize("kind", ["own.npz", "rows.npz", "named.npz", "ply", "pcd", "vtk", "bin"])
def test_no_returns_are_the_same_and_counted_in_every_kind(tmp_path, kind):
    """Zeros, NaN and infinity are left out, three of ten points."""
    points, path = spoilt(), tmp_path / f"cloud.{kind}"
    table = dict(zip("xyz", points.T, strict=True))
    match kind:
        case "own.npz":
            path.write_bytes(cloud_to_bytes(PointCloud(points, "sensor")))
        case "rows.npz":
            np.savez(path, points)
        case "named.npz":
            np.savez(path, **table)
        case "ply":
            path.write_bytes(ply.render(table))
        case "pcd":
            path.write_bytes(pcd.render(table))
        case "vtk":
            head = "# vtk DataFile Version 3.0\nd\nASCII\nDATASET POLYDATA\nPOINTS 10 float\n"
            path.write_text(head + "\n".join(" ".join(map(str, p)) for p in points.tolist()))
        case "bin":
            rows = np.column_stack([points, np.full(10, 0.5, np.float32)])
            path.write_bytes(rows.tobytes())
    decoded = decode_cloud_file(path, 4 if kind == "bin" else None)
    assert decoded.no_returns == 3
    np.testing.assert_allclose(decoded.cloud.points, points[[0, 1, 3, 4, 6, 8, 9]], rtol=1e-6)


def test_a_point_in_the_origin_of_the_base_is_one():
    """In a sensor's frame it is no return."""
    zero = np.zeros((1, 3))
    assert not are_returns(zero, "sensor").any()
    assert are_returns(zero, "base_footprint").all()


@pytest.mark.parametrize(
    "labels",
    [
        np.arange(40, dtype=np.uint16) * 1000,
        np.arange(40, dtype=np.int32) - 1,
        np.arange(40, dtype=np.int64) * 70_000,
        np.arange(40, dtype=np.float32) * 300,
    ],
)
@pytest.mark.parametrize("kind", KINDS)
def test_labels_of_any_width_are_kept(tmp_path, kind, labels):
    """Classes and instances come back from every kind."""
    needs_laspy(kind)
    columns = dict(zip("xyz", RNG.normal(size=(3, 40)), strict=True))
    decoded = decode_columns(columns | {"label": labels, "instance": labels[::-1]})
    path = tmp_path / f"cloud.{kind}"
    path.write_bytes(cloud_to_bytes(decoded.cloud, kind))
    again = decode_cloud_file(path).cloud
    np.testing.assert_array_equal(again.classes, labels)
    np.testing.assert_array_equal(again.instances, labels[::-1])


@pytest.mark.parametrize("labels", [np.linspace(0, 1, 40), np.full(40, np.nan), [2**40] * 40])
def test_labels_that_are_none_are_named(labels):
    """Fractions, NaN and 41 bits are no classes, and stay other columns."""
    columns = dict(zip("xyz", RNG.normal(size=(3, 40)), strict=True))
    decoded = decode_columns(columns | {"label": np.asarray(labels)})
    assert decoded.data_lost
    assert decoded.cloud.classes is None
    assert decoded.remarks[0].startswith("field label: expected whole numbers")
    assert "label" in decoded.others


@pytest.mark.parametrize("width", ["<u1", "<u2", "<u4", "<i8"])
def test_label_files_of_any_width(tmp_path, width):
    """The width follows from the size, and the assumed classes are noted."""
    for name in ("velodyne", "labels"):
        (tmp_path / name).mkdir()
    path = tmp_path / "velodyne" / "1.bin"
    rows = np.column_stack([RNG.normal(size=(40, 3)), np.zeros(40)]).astype("<f4")
    path.write_bytes(rows.tobytes())
    labels = np.resize([72, 71, 40, 252], 40)
    (tmp_path / "labels" / "1.label").write_bytes(labels.astype(width).tobytes())
    decoded = decode_cloud_file(path)
    np.testing.assert_array_equal(decoded.cloud.classes, labels)
    assert decoded.labelling.assumed
    assert decoded.labelling.found == (40, 71, 72, 252)
    assert "40, 44, 48, 49, 60, 72 are traversable" in " ".join(decoded.remarks)
    (tmp_path / "traversable.txt").write_text("72\n")
    sure = decode_cloud_file(path)
    assert sure.remarks == ()
    np.testing.assert_array_equal(sure.cloud.nontraversable, labels != 72)


def test_other_numbers_of_points_come_along_or_are_named():
    """Each kind names the columns that it cannot hold."""
    columns = dict(zip("xyz", RNG.normal(size=(3, 40)), strict=True))
    columns |= {"intensity": np.linspace(0, 1, 40), "ring": np.arange(40, dtype=np.uint16)}
    decoded = decode_columns(columns | {"id": np.full(40, 2**60)})
    assert columns_lost_by("pcd", decoded) == ()
    assert columns_lost_by("ply", decoded) == ("id",)
    assert columns_lost_by("bin", decoded) == ("ring", "id")
    back = pcd.parse(cloud_to_bytes(decoded.cloud, "pcd", decoded.others))
    np.testing.assert_array_equal(back["ring"], columns["ring"])


def test_whole_coordinates_are_taken_as_metres_with_a_remark():
    """The remark names their type."""
    table = {name: np.arange(1, 9, dtype=np.int16) for name in "xyz"}
    assert "(int16) taken as metres" in decode_columns(table).remarks[0]


def test_coordinates_may_be_capitals():
    """X, Y, Z are read as x, y, z where there are none of these."""
    columns = {name: np.arange(1.0, 4.0) for name in ("X", "Y", "Z", "Intensity")}
    decoded = decode_columns(columns)
    np.testing.assert_array_equal(decoded.cloud.points[:, 2], [1, 2, 3])
    assert list(decoded.others) == ["Intensity"]
    with pytest.raises(FormatError, match="expected fields x, y, z, got x, X"):
        decode_columns({"x": columns["X"], "X": columns["X"]})
