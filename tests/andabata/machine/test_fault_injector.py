"""Faults in readings: the known answer of each kind on each sense, and what stays untouched."""

from dataclasses import fields, replace

import numpy as np
import pytest

from andabata.machine.fault_injector import FaultInjector
from andabata.machine.faults import KINDS, SENSES, Fault, typical_faults
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings, Sweeps, VehicleState, WheelSpeeds
from traversability.cloud import PointCloud

FIELDS = {
    "laser": ("sweeps", "frames", "horizontal"),
    "gnss": ("gnss",),
    "compass": ("mag",),
    "imu": ("imu",),
    "wheels": ("encoders",),
}
"""Fields of the readings of each sense."""

STATE = VehicleState(
    0.0,
    Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])),
    np.zeros(3),
    np.zeros(3),
    WheelSpeeds(0.0, 0.0),
)


def rows(stamp, width, count):
    """Return rows whose values are all different; the last stamp is that of the period."""
    stamps = stamp + 0.01 * np.arange(1 - count, 1)
    values = stamps[:, None] + np.arange(1.0, width)
    return np.column_stack([stamps, values])


def period(number):
    """Return the readings of a control period of 0.1 s, all senses in it, counted from 1."""
    stamp = number / 10
    starts = stamp + np.array([-0.05, 0.0])
    ranges = stamp + np.array([[1.0, 2.0, np.inf], [3.0, 4.0, 5.0]], dtype=np.float32)
    sweeps = Sweeps(
        starts, starts * 2, 2.0, 1e-5, np.zeros(3, np.float32), ranges.astype(np.float32)
    )
    points = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 2.0 * stamp]], dtype=np.float32)
    cloud = PointCloud(points, "sensor", np.array([stamp - 0.05, stamp]))
    return SensorReadings(
        stamp,
        sweeps=sweeps,
        frames=(cloud,),
        horizontal=np.array([stamp, 9.0], dtype=np.float32),
        imu=rows(stamp, 7, 10),
        encoders=rows(stamp, 3, 10),
        mag=rows(stamp, 4, 10),
        gnss=rows(stamp, 5, 1),
        antenna=np.ones(3),
        truth=replace(STATE, stamp=stamp),
        true_track=rows(stamp, 8, 10),
        walkers=np.ones((1, 5)),
    )


PERIODS = [period(number) for number in range(1, 31)]


def injected(*faults, seed=0, periods=PERIODS):
    """Return the readings of all periods behind an injector of some faults."""
    injector = FaultInjector(
        [Fault.parse(fault) if isinstance(fault, str) else fault for fault in faults],
        np.random.default_rng(seed),
    )
    return [injector(readings) for readings in periods]


def during(text, name, periods=PERIODS):
    """Return a field of the readings from 1.0 s on, with a fault from then on."""
    found = injected(f"{text}@1", periods=periods)
    assert all(a is b for a, b in zip(found[:9], periods, strict=False))
    return [getattr(readings, name) for readings in found[9:]]


def same(first, second):
    """Return True if two readings are equal to the bit in all that an injector may change."""
    return all(
        repr_of(getattr(first, name)) == repr_of(getattr(second, name))
        for names in FIELDS.values()
        for name in names
    )


def repr_of(value):
    """Return a value of readings as bytes."""
    if isinstance(value, np.ndarray):
        return value.tobytes(), value.dtype, value.shape
    if isinstance(value, Sweeps | PointCloud):
        return [repr_of(getattr(value, field.name)) for field in fields(value)]
    return [repr_of(each) for each in value] if isinstance(value, tuple) else value


TYPICAL = typical_faults(SENSES, tuple(KINDS), 1.0, 1.0)


@pytest.mark.parametrize("fault", TYPICAL, ids=str)
def test_each_fault_acts_on_its_sense_alone_and_ends(fault):
    """Before and after it all readings are the very same objects; other senses and truth always."""
    given = [replace(readings) for readings in PERIODS]
    before = [repr_of(getattr(each, name)) for each in given for name in FIELDS[fault.sense]]
    found = injected(fault, periods=given)
    for old, new in zip(given, found, strict=True):
        is_on = 1.0 <= old.stamp < 2.0
        assert is_on or new is old
        assert new.stamp == old.stamp
        for field in fields(SensorReadings):
            if field.name not in FIELDS[fault.sense]:
                assert getattr(new, field.name) is getattr(old, field.name)
    for name in FIELDS[fault.sense]:
        # A third of the periods, or more, differs in each form of the sense.
        pairs = [(getattr(a, name), getattr(b, name)) for a, b in zip(given, found, strict=True)]
        assert sum(repr_of(a) != repr_of(b) for a, b in pairs) >= 3
    # No array of the source was written to.
    after = [repr_of(getattr(each, name)) for each in given for name in FIELDS[fault.sense]]
    assert before == after


@pytest.mark.parametrize("fault", TYPICAL, ids=str)
def test_the_same_seed_gives_the_same_bytes(fault):
    """Also of one injector that begins again."""
    once = injected(fault, seed=3)
    injector = FaultInjector([fault], np.random.default_rng(4))
    for readings in PERIODS:
        injector(readings)
    injector.reset(np.random.default_rng(3))
    again = [injector(readings) for readings in PERIODS]
    assert all(same(a, b) for a, b in zip(once, again, strict=True))


@pytest.mark.parametrize("fault", TYPICAL, ids=str)
def test_a_sense_that_is_not_there_has_no_fault(fault):
    """Readings without any sense pass; a silent one stays silent."""
    bare = [SensorReadings(each.stamp, gnss=np.empty((0, 5))) for each in PERIODS]
    found = injected(fault, periods=bare)
    assert all(same(a, b) for a, b in zip(bare, found, strict=True))


def test_off_leaves_no_rows_of_a_sensor_that_is_there():
    """Rows have none, of their width; sweeps and ranges are None, clouds none."""
    assert [each.shape for each in during("imu:off", "imu")] == [(0, 7)] * 21
    assert during("gnss:off", "gnss")[0].shape == (0, 5)
    assert during("laser:off", "sweeps") == [None] * 21
    assert during("laser:off", "frames") == [()] * 21
    assert during("laser:off", "horizontal") == [None] * 21


def test_stuck_repeats_the_last_values_with_fresh_stamps():
    """The last row before the onset, the last sweep's ranges, the last cloud as new as another."""
    for sense, name in (("imu", "imu"), ("gnss", "gnss"), ("compass", "mag")):
        last = getattr(PERIODS[8], name)[-1, 1:]
        for found, old in zip(during(f"{sense}:stuck", name), PERIODS[9:], strict=True):
            np.testing.assert_array_equal(found[:, 0], getattr(old, name)[:, 0])
            assert (found[:, 1:] == last).all()
    for found, old in zip(during("laser:stuck", "sweeps"), PERIODS[9:], strict=True):
        assert (found.ranges == PERIODS[8].sweeps.ranges[-1]).all()
        assert found.ranges.dtype == np.float32
        np.testing.assert_array_equal(found.stamps, old.sweeps.stamps)
        np.testing.assert_array_equal(found.head_angles, old.sweeps.head_angles)
    for (found,), old in zip(during("laser:stuck", "frames"), PERIODS[9:], strict=True):
        np.testing.assert_array_equal(found.points, PERIODS[8].frames[0].points)
        np.testing.assert_allclose(found.stamps, old.frames[0].stamps, atol=1e-12)
    ranges = during("laser:stuck", "horizontal")
    assert all((each == PERIODS[8].horizontal).all() for each in ranges)


def test_stuck_from_the_start_repeats_the_first_values():
    """Without a reading before it the first one counts; a silent sense is not woken."""
    found = [readings.imu for readings in injected("imu:stuck")]
    assert all((each[:, 1:] == PERIODS[0].imu[0, 1:]).all() for each in found)
    silent = [*PERIODS[:9], *(replace(each, gnss=np.empty((0, 5))) for each in PERIODS[9:])]
    assert all(len(each) == 0 for each in during("gnss:stuck", "gnss", silent))


def test_a_stuck_cloud_without_times_or_points_repeats_as_it_is():
    """There is nothing to renew, whichever of the two clouds lacks it."""
    full = PERIODS[0].frames[0]
    timeless, empty = PointCloud(full.points, "sensor"), full.select(np.zeros(2, dtype=bool))
    for last, now in ((full, timeless), (timeless, full), (full, empty), (empty, full)):
        given = [replace(each, frames=(last,)) for each in PERIODS[:9]]
        given += [replace(each, frames=(now,)) for each in PERIODS[9:]]
        assert during("laser:stuck", "frames", given)[0] == (last,)


def test_garbage_is_not_finite_or_huge_in_its_share():
    """A quarter of all values, none of the stamps; the others stay; dtypes too."""
    found = np.concatenate(during("imu:garbage=0.25", "imu"))
    old = np.concatenate([each.imu for each in PERIODS[9:]])
    np.testing.assert_array_equal(found[:, 0], old[:, 0])
    bad = ~(np.abs(found[:, 1:]) < 1e29)
    assert bad.mean() == pytest.approx(0.25, abs=0.05)
    np.testing.assert_array_equal(found[:, 1:][~bad], old[:, 1:][~bad])
    values = found[:, 1:][bad]
    assert np.isnan(values).any()
    assert {np.inf, -np.inf, 1e30, -1e30} <= set(values.tolist())
    (cloud,) = during("laser:garbage=1", "frames")[0]
    assert (~(np.abs(cloud.points) < 1e29)).all()
    assert cloud.points.dtype == during("laser:garbage", "sweeps")[0].ranges.dtype == np.float32


def test_scale_multiplies_values_and_neither_stamps_nor_variances():
    """Places but no variance of fixes; all else of the others."""
    for sense, name in (("imu", "imu"), ("compass", "mag"), ("wheels", "encoders")):
        old = getattr(PERIODS[9], name)
        found = during(f"{sense}:scale=2", name)[0]
        np.testing.assert_array_equal(found, np.column_stack([old[:, 0], 2 * old[:, 1:]]))
    found, old = during("gnss:scale=-3", "gnss")[0], PERIODS[9].gnss
    np.testing.assert_array_equal(found, old * [1.0, -3.0, -3.0, -3.0, 1.0])
    ranges = during("laser:scale=0.5", "sweeps")[0].ranges
    np.testing.assert_array_equal(ranges, PERIODS[9].sweeps.ranges * np.float32(0.5))
    (cloud,) = during("laser:scale=0.5", "frames")[0]
    np.testing.assert_array_equal(cloud.points, PERIODS[9].frames[0].points / 2)
    found = during("laser:scale=2", "horizontal")[0]
    np.testing.assert_array_equal(found, PERIODS[9].horizontal * 2)


def test_slow_keeps_an_even_share_of_the_messages():
    """Every fifth row, every fourth sweep and cloud, counted from the onset over all periods."""
    old = np.concatenate([each.imu for each in PERIODS[9:]])
    np.testing.assert_array_equal(np.concatenate(during("imu:slow=0.2", "imu")), old[4::5])
    kept = [each for each in during("laser:slow=0.25", "sweeps") if each is not None]
    assert [each.stamps.tolist() for each in kept] == [
        [PERIODS[k].sweeps.stamps[1]] for k in range(10, 30, 2)
    ]
    np.testing.assert_array_equal(kept[0].ranges, PERIODS[10].sweeps.ranges[1:])
    clouds = [len(each) for each in during("laser:slow=0.25", "frames")]
    assert clouds == [0, 0, 0, 1] * 5 + [0]
    ranges = [each is not None for each in during("laser:slow=0.25", "horizontal")]
    assert ranges == [False, False, False, True] * 5 + [False]
    fixes = [len(each) for each in during("gnss:slow=0.1", "gnss")]
    assert fixes == ([0] * 9 + [1]) * 2 + [0]


def test_delayed_messages_come_late_with_their_own_stamps():
    """What was sent 0.3 s ago; nothing at first, and at the end what is under way is lost."""
    found = during("gnss:delayed=0.3", "gnss")
    assert [len(each) for each in found[:3]] == [0, 0, 0]
    for late, old in zip(found[3:], PERIODS[9:], strict=False):
        np.testing.assert_array_equal(late, old.gnss)
    sweeps = during("laser:delayed=0.3", "sweeps")
    assert sweeps[:3] == [None] * 3
    assert sweeps[3] is PERIODS[9].sweeps
    found = injected("imu:delayed=0.3@1+1")
    assert found[19] is PERIODS[19]


def test_what_is_due_at_once_comes_as_one_batch():
    """Rows, sweeps and clouds of two periods follow one another, of ranges the newest count."""
    sparse = [*PERIODS[:12], *PERIODS[13:]]
    old = PERIODS[10], PERIODS[11]
    find = {name: during("laser:delayed=0.15", name, sparse)[3] for name in FIELDS["laser"]}
    stamps = np.concatenate([each.sweeps.stamps for each in old])
    np.testing.assert_array_equal(find["sweeps"].stamps, stamps)
    assert find["sweeps"].ranges.shape == (4, 3)
    assert find["sweeps"].head_angles.shape == (4,)
    assert find["frames"] == (old[0].frames[0], old[1].frames[0])
    assert find["horizontal"] is old[1].horizontal
    found = during("imu:delayed=0.15", "imu", sparse)[3]
    np.testing.assert_array_equal(found, np.concatenate([each.imu for each in old]))


def test_sweeps_with_beams_and_classes_of_their_own_keep_them():
    """Elevations by sweep and classes are selected and joined with their sweeps."""
    own = [
        replace(
            each,
            sweeps=replace(
                each.sweeps,
                elevations=np.full((2, 3), each.stamp, np.float32),
                classes=np.full((2, 3), number, np.uint8),
            ),
        )
        for number, each in enumerate(PERIODS)
    ]
    (first, *_) = [each for each in during("laser:slow=0.25", "sweeps", own) if each is not None]
    assert first.elevations.shape == first.classes.shape == first.ranges.shape == (1, 3)
    joined = during("laser:delayed=0.15", "sweeps", [*own[:12], *own[13:]])[3]
    assert joined.classes[:, 0].tolist() == [10, 10, 11, 11]
    assert joined.elevations.shape == (4, 3)


def test_intermittent_is_off_in_the_first_half_of_each_period():
    """Of 0.4 s two control periods of 0.1 s each are silent, then two are not."""
    found = during("wheels:intermittent=0.4", "encoders")
    assert [len(each) for each in found[:9]] == [0, 0, 10, 10, 0, 0, 10, 10, 0]
    assert during("laser:intermittent=0.4", "sweeps")[2] is PERIODS[11].sweeps


def test_jumps_have_the_unit_of_their_sense():
    """Metres to the north, radians of heading, rad/s of yaw rate and of wheels, metres of range."""
    found, old = during("gnss:jump=1111.95", "gnss")[0], PERIODS[9].gnss
    np.testing.assert_allclose(found - old, [[0, 0.01, 0, 0, 0]], atol=1e-9)
    found, old = during("imu:jump=0.3", "imu")[0], PERIODS[9].imu
    np.testing.assert_allclose(found - old, np.tile([0, 0, 0, 0.3, 0, 0, 0], (10, 1)), atol=1e-12)
    found, old = during("wheels:jump=-2", "encoders")[0], PERIODS[9].encoders
    np.testing.assert_allclose(found - old, np.tile([0, -2.0, -2.0], (10, 1)), atol=1e-12)
    ranges, old = during("laser:jump=-2.5", "sweeps")[0].ranges, PERIODS[9].sweeps.ranges
    np.testing.assert_array_equal(ranges, np.maximum(old - np.float32(2.5), 0))
    assert ranges[0, 0] == 0.0
    assert ranges[0, 2] == np.inf
    (cloud,) = during("laser:jump=2.5", "frames")[0]
    np.testing.assert_allclose(cloud.points, [[4.5, 6.0, 0.0], [0.0, 0.0, 4.5]], rtol=1e-6)
    found = during("laser:jump=2.5", "horizontal")[0]
    np.testing.assert_array_equal(found, PERIODS[9].horizontal + np.float32(2.5))


def test_a_jump_of_the_compass_turns_its_heading_to_the_left():
    """A body that heads north, with the field ahead, seems to head by the angle farther left."""
    north = [replace(each, mag=np.array([[each.stamp, 2.0, 0.0, -1.0]])) for each in PERIODS]
    found = during(f"compass:jump={np.pi / 2}", "mag", north)[0]
    # West of north, with the field to its right.
    np.testing.assert_allclose(found[0, 1:], [0.0, -2.0, -1.0], atol=1e-12)


def test_several_faults_act_one_after_the_other():
    """Off from 2 s on, twice the speed before; garbage does not depend on the faults beside it."""
    found = injected("wheels:scale=2@1", "wheels:off@2", "imu:garbage@1")
    np.testing.assert_array_equal(found[10].encoders[:, 1:], 2 * PERIODS[10].encoders[:, 1:])
    assert found[20].encoders.shape == (0, 3)
    alone = injected("gnss:off@1", "compass:off@1", "imu:garbage@1")
    assert repr_of(found[12].imu) == repr_of(alone[12].imu)


def test_without_faults_readings_pass():
    """They are the very same objects."""
    assert all(a is b for a, b in zip(injected(), PERIODS, strict=True))
