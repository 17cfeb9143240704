"""DDS types are those of the message definitions, and their bytes are rosbags' own."""

from types import SimpleNamespace

import numpy as np
import pytest

from andabata.records.messages import MessageBuilder
from andabata.records.topics import message_types
from andabata.ros.dds_types import dds_name, dds_struct, message_kind, raw_sample, raw_type
from tests.support.ros2_tools import needs_dds

IMU, TF = "sensor_msgs/msg/Imu", "tf2_msgs/msg/TFMessage"
BUILDER = MessageBuilder(2)
ROW = np.array([1.5, 0.1, 0.2, 0.3, 4.0, 5.0, 6.0])
MESSAGES = {IMU: BUILDER.imu(ROW), TF: BUILDER.transform(2.5, np.arange(7.0), TF)}


def plain(message):
    """Return a message as nested plain values, which DDS's own serialiser takes."""
    if hasattr(message, "__dataclass_fields__"):
        names = [name for name in message.__dataclass_fields__ if name != "__msgtype__"]
        return SimpleNamespace(**{name: plain(getattr(message, name)) for name in names})
    if isinstance(message, list | np.ndarray):
        return [plain(each) for each in message]
    return message


@needs_dds
@pytest.mark.parametrize("kind", MESSAGES)
def test_dds_serialises_our_types_to_the_bytes_of_rosbags(kind):
    """An independent serialiser, fed with the generated types, writes the same bytes."""
    store = message_types(2)
    struct = dds_struct(kind, store)
    data = struct.__idl__.serialize(plain(MESSAGES[kind]), use_version_2=False)
    assert data == bytes(store.serialize_cdr(MESSAGES[kind], kind))


@needs_dds
def test_bytes_pass_through_unchanged():
    """A sample gives the bytes that it was made of, and is made of received ones."""
    raw = raw_type(IMU, message_types(2))
    data = b"\x00\x01\x00\x00anything"
    assert raw_sample(raw, data).serialize(use_version_2=False) == data
    assert raw.deserialize(data).data_bytes == data


def test_names_are_those_of_ros_2():
    """The two directions belong together; foreign names stay."""
    assert dds_name(IMU) == "sensor_msgs::msg::dds_::Imu_"
    assert message_kind(dds_name(IMU)) == IMU
    assert message_kind("HelloWorld") == "HelloWorld"
