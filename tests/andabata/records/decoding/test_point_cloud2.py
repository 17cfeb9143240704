"""Points of PointCloud2 messages of any driver, with their times and remarks."""

import struct
from dataclasses import replace

import numpy as np
import pytest

from andabata.records.decoding.point_cloud2 import (
    PointCloudError,
    as_point_cloud2,
    cloud_of,
    decode_point_cloud2,
    point_columns,
)
from andabata.records.decoding.unusable_message import UnusableMessageError
from andabata.records.messages import MessageBuilder
from andabata.records.topics import POINT_CLOUD
from tests.support import computed_bags
from tests.support.computed_bags import new
from tests.support.foreign_messages import header
from traversability.formats.coordinate_units import CoordinateUnits

NUMBERS = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}
COMPOSE = MessageBuilder(2)
SECONDS = COMPOSE.epoch_ns / 1e9


def message(columns, frame="lidar", counts=None, **changes):
    """Return a cloud with named columns, packed as they come."""
    rows = np.zeros(
        len(next(iter(columns.values()))), dtype=[(n, c.dtype) for n, c in columns.items()]
    )
    for name, column in columns.items():
        rows[name] = column
    fields = [
        COMPOSE.new(
            "sensor_msgs/msg/PointField",
            name=name,
            offset=rows.dtype.fields[name][1],
            datatype=NUMBERS[rows.dtype[name].str[1:]],
            count=(counts or {}).get(name, 1),
        )
        for name in columns
    ]
    parts = {
        "header": COMPOSE.header(0.0, frame),
        "height": 1,
        "width": len(rows),
        "fields": fields,
        "is_bigendian": False,
        "point_step": rows.itemsize,
        "row_step": rows.nbytes,
        "data": np.frombuffer(rows.tobytes(), dtype=np.uint8),
        "is_dense": True,
    }
    return COMPOSE.new(POINT_CLOUD, **(parts | changes))


def xyz(points):
    return dict(zip("xyz", np.asarray(points, dtype=np.float32).T, strict=True))


POINTS = np.array([[1.0, 2, 3], [0, 0, 0], [np.nan, 1, 1], [4, 5, 6], [np.inf, 0, 0]])


def test_no_returns_of_a_sensor_are_left_out_with_their_times_and_counted():
    """Points at the origin or not finite are left out with their times."""
    times = np.array([0.01, 0.0, 0.02, 0.09, 0.0])
    stamps = SECONDS + times
    stamps[1] = 0.0  # Drivers fill a slot without a return with zeros.
    decoded = decode_point_cloud2(message(xyz(POINTS) | {"timestamp": stamps}), None, 7.0)
    assert decoded.no_returns == 3
    np.testing.assert_array_equal(decoded.cloud.points, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_allclose(decoded.cloud.stamps, [7.01, 7.09], atol=1e-6)
    assert decoded.remarks == ()


def test_the_origin_of_the_base_may_be_a_point():
    """Only in a sensor frame is the origin no return."""
    decoded = decode_point_cloud2(message(xyz(POINTS), "base_footprint"))
    assert (decoded.no_returns, len(decoded.cloud)) == (2, 3)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("timestamp", (np.array([0.0, 0.05]) + SECONDS) * 1e9),
        ("t", np.array([0, 50_000_000], dtype="u4")),
        ("time", np.array([0, 0.05], dtype="f4")),
        ("time", np.array([0, 50_000], dtype="f4")),
    ],
)
def test_times_are_the_same_whichever_driver_wrote_them(name, values):
    """Absolute and relative times, in ns, us or s, give equal stamps."""
    columns = xyz([[1, 1, 1], [2, 2, 2]]) | {name: values}
    decoded = decode_point_cloud2(message(columns), None, 3.0)
    np.testing.assert_allclose(decoded.cloud.stamps, [3.0, 3.05], atol=1e-6)


def test_impossible_times_are_replaced_by_the_headers():
    """Times out of reach are remarked on and the header used."""
    columns = xyz([[1, 1, 1], [2, 2, 2]]) | {"time": np.array([0, 5e6], dtype="f4")}
    decoded = decode_point_cloud2(message(columns), None, 3.0)
    np.testing.assert_array_equal(decoded.cloud.stamps, [3.0, 3.0])
    assert decoded.remarks[0].startswith("field time: expected point times")
    odd = message(columns, counts={"time": 2})
    assert "got 2; not used" in decode_point_cloud2(odd, None, 3.0).remarks[0]
    assert decode_point_cloud2(odd).remarks == ()


def test_far_coordinates_in_doubles_are_kept():
    """Coordinates beyond float32 keep their precision."""
    far = np.array([[701_362.561, 4_485_513.722, 312.345], [701_363.0, 4_485_514.0, 313.0]])
    cloud = decode_point_cloud2(message(dict(zip("xyz", far.T, strict=True)))).cloud
    np.testing.assert_allclose(cloud.coordinates(), far, atol=1e-6)


def test_whole_numbers_are_metres():
    """Integers are metres, with a remark."""
    columns = {name: np.array([1, 2], dtype="i2") for name in "xyz"}
    decoded = decode_point_cloud2(message(columns))
    np.testing.assert_array_equal(decoded.cloud.points, [[1, 1, 1], [2, 2, 2]])
    assert "int16" in decoded.remarks[0]


def test_a_row_that_is_the_only_one_needs_no_length():
    """The row length of a single row is ignored."""
    for row_step in (0, 3, 10_000):
        assert len(decode_point_cloud2(message(xyz(POINTS), row_step=row_step)).cloud) == 2


def test_contradictions_are_errors():
    """Counts and sizes that contradict each other are errors."""
    with pytest.raises(PointCloudError, match="field x: expected one number a point, got 3"):
        decode_point_cloud2(message(xyz(POINTS), counts={"x": 3}))
    with pytest.raises(PointCloudError, match="expected points, got"):
        decode_point_cloud2(message(xyz(POINTS), width=2**31, height=2**31))
    with pytest.raises(PointCloudError, match="rows of"):
        decode_point_cloud2(message(xyz(POINTS), width=6))
    with pytest.raises(PointCloudError, match="expected points, got 0 times 1"):
        decode_point_cloud2(message(xyz(np.zeros((0, 3)))))


def test_rows_are_read_by_their_own_length():
    """Bytes between two rows are skipped, and rows follow each other."""
    rows = np.arange(12, dtype="f4").reshape(4, 3)
    padding = b"\xff" * 5
    padded = rows[:2].tobytes() + padding + rows[2:].tobytes() + padding
    cloud = decode_point_cloud2(
        message(xyz(rows), height=2, width=2, row_step=29, data=np.frombuffer(padded, np.uint8)),
        "base_link",
    ).cloud
    np.testing.assert_array_equal(cloud.points, rows)


def test_all_fields_of_all_points_become_columns():
    """Types are kept, several numbers are numbered, and points without a return stay."""
    columns, _ = point_columns(message(xyz(POINTS) | {"ring": np.arange(5, dtype="u2")}))
    assert {name: column.dtype.str for name, column in columns.items()} == {
        "x": "<f4", "y": "<f4", "z": "<f4", "ring": "<u2",
    }  # fmt: skip
    np.testing.assert_array_equal(columns["ring"], np.arange(5))
    np.testing.assert_array_equal(columns["x"], POINTS[:, 0].astype("f4"))
    pairs = message({"x": np.array([1, 2], "f4"), "y": np.array([3, 4], "f4")}, counts={"x": 2})
    columns, _ = point_columns(pairs)
    assert {name: column.tolist() for name, column in columns.items()} == {
        "x_0": [1, 2], "x_1": [3, 4], "y": [3, 4],
    }  # fmt: skip
    empty, _ = point_columns(message(xyz(np.zeros((0, 3)))))
    assert [len(column) for column in empty.values()] == [0, 0, 0]


def test_columns_are_in_the_byte_order_of_the_machine():
    """Big-endian numbers keep their values."""
    swapped = {name: column.astype(">f4") for name, column in xyz(POINTS[3:4]).items()}
    columns, _ = point_columns(message(swapped, is_bigendian=True))
    assert [columns[name].tolist() for name in "xyz"] == [[4], [5], [6]]
    assert columns["x"].dtype.isnative


def test_names_of_columns_differ():
    """Spaces are replaced and repeated names numbered."""
    fields = message(xyz(POINTS[:1])).fields
    named = [
        replace(field, name=name) for field, name in zip(fields, ("a b", "a_b", ""), strict=True)
    ]
    columns, _ = point_columns(message(xyz(POINTS[:1]), fields=named))
    assert list(columns) == ["a_b", "a_b_2", "field"]


def test_a_field_outside_of_its_point_is_an_error():
    """The last byte of a field must lie inside the point."""
    fields = message(xyz(POINTS)).fields
    for changes in ({"offset": 9}, {"count": 2}, {"datatype": 9}):
        wrong = [*fields[:2], replace(fields[2], **changes)]
        with pytest.raises(PointCloudError, match="field z: expected numbers inside 12 bytes"):
            point_columns(message(xyz(POINTS), fields=wrong))
    with pytest.raises(PointCloudError, match="expected x, y and z, got none"):
        point_columns(message(xyz(POINTS), fields=[]))


def test_the_older_point_cloud_keeps_points_and_channels():
    """PointCloud keeps its points, and its channels as fields."""
    point, channel = (
        computed_bags.TYPES.types[f"{kind}"]
        for kind in ("geometry_msgs/msg/Point32", "sensor_msgs/msg/ChannelFloat32")
    )
    message = new(
        "sensor_msgs/msg/PointCloud",
        header=header(),
        points=[point(x=float(k), y=2.0, z=-1.0) for k in range(4)],
        channels=[channel(name="time", values=np.arange(4, dtype=np.float32) / 100)],
    )
    cloud = cloud_of(as_point_cloud2(message), None, 5.0)
    np.testing.assert_array_equal(cloud.points, [[k, 2, -1] for k in range(4)])
    np.testing.assert_allclose(cloud.stamps, 5.0 + np.arange(4) / 100, atol=1e-7)
    with pytest.raises(UnusableMessageError, match="channel"):
        as_point_cloud2(replace(message, points=message.points[:2]))


def foreign(points, dtype, offsets, step, big=False, rows=1, pad=0):
    """Return a PointCloud2 with its own layout."""
    builder, order = MessageBuilder(2), ">" if big else "<"
    number = {"f4": 7, "f8": 8, "i2": 3}[dtype]
    width = len(points) // rows
    data = bytearray()
    size = {"f4": "f", "f8": "d", "i2": "h"}[dtype]
    for k, point in enumerate(points):
        record = bytearray(b"\xff" * step)
        for value, offset in zip(point, offsets, strict=True):
            struct.pack_into(f"{order}{size}", record, offset, value)
        data += record
        if (k + 1) % width == 0:
            data += b"\xee" * pad
    fields = [
        builder.new("sensor_msgs/msg/PointField", name=n, offset=o, datatype=number, count=1)
        for n, o in zip("xyz", offsets, strict=True)
    ]
    return builder.new(
        "sensor_msgs/msg/PointCloud2",
        header=builder.header(0.0, "velodyne"),
        height=rows,
        width=width,
        fields=fields,
        is_bigendian=big,
        point_step=step,
        row_step=step * width + pad,
        data=np.frombuffer(bytes(data), dtype=np.uint8),
        is_dense=False,
    )


@pytest.mark.parametrize("big", [False, True])
@pytest.mark.parametrize(
    ("dtype", "offsets", "step", "rows", "pad"),
    [
        ("f4", (0, 4, 8), 12, 1, 0),
        ("f4", (8, 0, 20), 32, 4, 7),
        ("f8", (1, 9, 17), 29, 2, 3),
        ("i2", (2, 4, 6), 16, 1, 0),
    ],
)
def test_any_layout_of_points_is_read(dtype, offsets, step, rows, pad, big):
    """Points are read from any offsets, types, padding and byte order."""
    points = np.arange(24).reshape(8, 3) - 5
    cloud = cloud_of(foreign(points, dtype, offsets, step, big, rows, pad))
    np.testing.assert_array_equal(cloud.points, points)
    assert cloud.frame == "sensor"


def seen(count=400):
    """Return points at the distances that lasers measure, with slots of zeros and NaN."""
    points = np.random.default_rng(0).normal(0, 8, (count, 3))
    points[::3], points[1::7] = 0.0, np.nan
    return points


@pytest.mark.parametrize("dtype", ["f4", "f8"])
@pytest.mark.parametrize("big", [False, True])
def test_the_byte_order_is_that_of_the_coordinates(dtype, big):
    """A flag that makes nonsense of the coordinates is not believed, for any field; it is said."""
    points = seen()
    right = foreign(points, dtype, (0, 8, 16), 24, big)
    wrong = replace(right, is_bigendian=not big)
    assert decode_point_cloud2(right).remarks == ()
    decoded = decode_point_cloud2(wrong)
    np.testing.assert_array_equal(decoded.cloud.points, cloud_of(right).points)
    name = "big-endian" if big else "little-endian"
    assert decoded.remarks == (
        f"is_bigendian: the coordinates are {name}, against the flag; read so",
    )
    columns, remarks = point_columns(wrong)
    np.testing.assert_array_equal(columns["x"], points[:, 0].astype(dtype))
    assert remarks == decoded.remarks


def test_whole_numbers_have_a_byte_order_too():
    """Whole numbers of 32 bits that would be beyond the Earth are in the other order."""
    millimetres = {name: np.arange(1, 40, dtype="i4") * 321 for name in "xyz"}
    decoded = decode_point_cloud2(message(millimetres, is_bigendian=True))
    np.testing.assert_array_equal(decoded.cloud.coordinates()[:, 0], np.arange(1, 40) * 321)


def test_coordinates_that_are_nonsense_in_both_orders_are_refused():
    """Bytes that are no coordinates at all make no cloud."""
    data = np.random.default_rng(0).integers(0, 256, 4800, dtype=np.uint8)
    noise = replace(foreign(seen(), "f4", (0, 4, 8), 12), data=data)
    with pytest.raises(PointCloudError, match="no lengths in either byte order"):
        cloud_of(noise)


def test_a_cloud_without_returns_keeps_its_flag():
    """Zeros and NaN say nothing on the byte order."""
    for value in (0.0, np.nan):
        empty = foreign(np.full((9, 3), value), "f4", (0, 4, 8), 12, big=True)
        assert decode_point_cloud2(empty).remarks == ()


@pytest.mark.parametrize("row_step", [4 * 2 * 12, 7, 24 * 100])
def test_rows_without_gaps_are_recognised_by_the_length_of_the_data(row_step):
    """A row_step that is no row's length is not believed where the data fit without it."""
    points = np.arange(24).reshape(8, 3) - 5
    cloud = replace(foreign(points, "f4", (0, 4, 8), 12, rows=4), row_step=row_step)
    decoded = decode_point_cloud2(cloud)
    np.testing.assert_array_equal(decoded.cloud.points, points)
    (text,) = decoded.remarks
    assert text.startswith("row_step: is not the length of a row")
    with pytest.raises(PointCloudError, match="rows of"):
        decode_point_cloud2(replace(cloud, data=cloud.data[:-1]))


def test_points_in_another_unit_become_metres():
    """The unit that the user gives overrides ROS's metres."""
    decoded = decode_point_cloud2(message(xyz(POINTS * 1000)), units=CoordinateUnits.given(0.001))
    np.testing.assert_allclose(decoded.cloud.points, [[1, 2, 3], [4, 5, 6]], rtol=1e-6)


def test_points_that_are_not_finite_are_left_out():
    """Points with NaN or infinite coordinates are dropped."""
    points = np.array([[1.0, 2, 3], [np.nan, 0, 0], [0, np.inf, 0], [4, 5, 6]])
    cloud = cloud_of(foreign(points, "f4", (0, 4, 8), 16))
    np.testing.assert_array_equal(cloud.points, [[1, 2, 3], [4, 5, 6]])


def test_an_inconsistent_cloud_is_an_error():
    """Wrong sizes, offsets and missing fields raise a PointCloudError."""
    message = foreign(np.ones((4, 3)), "f4", (0, 4, 8), 12)
    with pytest.raises(PointCloudError, match="rows of"):
        cloud_of(replace(message, width=5, row_step=60))
    with pytest.raises(PointCloudError, match="field z"):
        cloud_of(replace(message, point_step=10, row_step=48))
    with pytest.raises(PointCloudError, match="x, y and z"):
        cloud_of(replace(message, fields=message.fields[:2]))
