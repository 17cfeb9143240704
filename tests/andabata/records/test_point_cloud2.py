"""PointCloud2 of any driver: points, times and what is to be said of them."""

import numpy as np
import pytest

from andabata.records.messages import MessageBuilder
from andabata.records.point_cloud2 import PointCloudError, decode_point_cloud2
from andabata.records.topics import POINT_CLOUD

NUMBERS = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}
BUILDER = MessageBuilder(2)
SECONDS = BUILDER.epoch_ns / 1e9


def message(columns, frame="lidar", counts=None, **changes):
    """Return a cloud with named columns, packed as they come."""
    rows = np.zeros(
        len(next(iter(columns.values()))), dtype=[(n, c.dtype) for n, c in columns.items()]
    )
    for name, column in columns.items():
        rows[name] = column
    fields = [
        BUILDER.new(
            "sensor_msgs/msg/PointField",
            name=name,
            offset=rows.dtype.fields[name][1],
            datatype=NUMBERS[rows.dtype[name].str[1:]],
            count=(counts or {}).get(name, 1),
        )
        for name in columns
    ]
    parts = {
        "header": BUILDER.header(0.0, frame),
        "height": 1,
        "width": len(rows),
        "fields": fields,
        "is_bigendian": False,
        "point_step": rows.itemsize,
        "row_step": rows.nbytes,
        "data": np.frombuffer(rows.tobytes(), dtype=np.uint8),
        "is_dense": True,
    }
    return BUILDER.new(POINT_CLOUD, **(parts | changes))


def xyz(points):
    return dict(zip("xyz", np.asarray(points, dtype=np.float32).T, strict=True))


POINTS = np.array([[1.0, 2, 3], [0, 0, 0], [np.nan, 1, 1], [4, 5, 6], [np.inf, 0, 0]])


def test_no_returns_of_a_sensor_are_left_out_with_their_times_and_counted():
    times = np.array([0.01, 0.0, 0.02, 0.09, 0.0])
    stamps = SECONDS + times
    stamps[1] = 0.0  # Drivers fill a slot without a return with zeros.
    decoded = decode_point_cloud2(message(xyz(POINTS) | {"timestamp": stamps}), None, 7.0)
    assert decoded.no_returns == 3
    np.testing.assert_array_equal(decoded.cloud.points, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_allclose(decoded.cloud.stamps, [7.01, 7.09], atol=1e-6)
    assert decoded.remarks == ()


def test_the_origin_of_the_base_may_be_a_point():
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
    columns = xyz([[1, 1, 1], [2, 2, 2]]) | {name: values}
    decoded = decode_point_cloud2(message(columns), None, 3.0)
    np.testing.assert_allclose(decoded.cloud.stamps, [3.0, 3.05], atol=1e-6)


def test_times_that_cannot_be_are_named_and_the_headers_taken():
    columns = xyz([[1, 1, 1], [2, 2, 2]]) | {"time": np.array([0, 5e6], dtype="f4")}
    decoded = decode_point_cloud2(message(columns), None, 3.0)
    np.testing.assert_array_equal(decoded.cloud.stamps, [3.0, 3.0])
    assert decoded.remarks[0].startswith("field time: expected point times")
    odd = message(columns, counts={"time": 2})
    assert "got 2; not used" in decode_point_cloud2(odd, None, 3.0).remarks[0]
    assert decode_point_cloud2(odd).remarks == ()


def test_far_coordinates_in_doubles_are_kept():
    far = np.array([[701_362.561, 4_485_513.722, 312.345], [701_363.0, 4_485_514.0, 313.0]])
    cloud = decode_point_cloud2(message(dict(zip("xyz", far.T, strict=True)))).cloud
    np.testing.assert_allclose(cloud.coordinates(), far, atol=1e-6)


def test_whole_numbers_are_metres_and_that_is_said():
    columns = {name: np.array([1, 2], dtype="i2") for name in "xyz"}
    decoded = decode_point_cloud2(message(columns))
    np.testing.assert_array_equal(decoded.cloud.points, [[1, 1, 1], [2, 2, 2]])
    assert "int16" in decoded.remarks[0]


def test_a_row_that_is_the_only_one_needs_no_length():
    for row_step in (0, 3, 10_000):
        assert len(decode_point_cloud2(message(xyz(POINTS), row_step=row_step)).cloud) == 2


def test_contradictions_are_errors():
    with pytest.raises(PointCloudError, match="field x: expected one number a point, got 3"):
        decode_point_cloud2(message(xyz(POINTS), counts={"x": 3}))
    with pytest.raises(PointCloudError, match="expected points, got"):
        decode_point_cloud2(message(xyz(POINTS), width=2**31, height=2**31))
    with pytest.raises(PointCloudError, match="rows of"):
        decode_point_cloud2(message(xyz(POINTS), width=6))
