"""Plausibility of inertial unit, encoders and compass: what is not believed, why, and what is."""

import numpy as np
import pytest

from andabata.localization.filter_state import STATES
from andabata.localization.plausibility import INVALID, STALE, Doubt, Plausibility, SenseRows
from andabata.localization.sense_watch import PlausibilityConfig, Wheel
from andabata.machine.proprioception import GRAVITY

WHEEL = Wheel(radius=0.1, yaw_rate=0.17)
LEVEL = np.zeros(STATES)
FLUX = np.array([25.0, 0.0, -34.0])


class Senses:
    """Noisy rows of a level robot, ten of each sense in a period of 0.1 s."""

    def __init__(self, resolution=0.0, seed=0):
        self.rng, self.resolution = np.random.default_rng(seed), resolution
        self.now = self.yaw = self.speed = 0.0

    def rows(self, speed=0.5, turn=0.0):
        """Return the rows of a period at a speed [m/s] and a yaw rate [rad/s]."""
        stamps = self.now + np.arange(1, 11) / 100
        yaw, self.yaw = self.yaw + turn * (stamps - self.now), self.yaw + 0.1 * turn
        self.now = stamps[-1]
        imu, wheels, mag = np.zeros((10, 7)), np.zeros((10, 3)), np.zeros((10, 4))
        imu[:, 3], imu[:, 4], imu[:, 6] = turn, (speed - self.speed) / 0.1, GRAVITY
        self.speed = speed
        difference = turn / WHEEL.yaw_rate
        wheels[:, 1:] = speed / WHEEL.radius + np.array([-0.5, 0.5]) * difference
        mag[:, 1] = FLUX[0] * np.cos(yaw)
        mag[:, 2] = -FLUX[0] * np.sin(yaw)
        mag[:, 3] = FLUX[2]
        for rows, sigma in ((imu, 0.003), (mag, 0.4)):
            rows[:, 1:] += sigma * self.rng.standard_normal(rows[:, 1:].shape)
        if self.resolution:
            for rows, step in ((imu, self.resolution), (mag, 50 * self.resolution)):
                rows[:, 1:] = np.round(rows[:, 1:] / step) * step
        for rows in (imu, wheels, mag):
            rows[:, 0] = stamps
        return SenseRows(imu, wheels, mag)


def drive(check, senses, seconds, change=lambda rows: rows, **motion):
    """Return the doubts after each period of a drive."""
    found = []
    for _ in range(round(seconds * 10)):
        begin = senses.now
        rows = change(senses.rows(**motion))
        check.believed(senses.now, begin, rows, LEVEL)
        found.append(dict(check.doubts))
    return found


def fresh(**config):
    """Return a check that has seen nothing."""
    return Plausibility(PlausibilityConfig(**config), WHEEL)


def flagged(found):
    """Return the time until the first doubt [s]."""
    return next((k + 1) / 10 for k, doubts in enumerate(found) if doubts)


def hanging(field):
    """Return a change after which a sense repeats its row of the begin."""
    kept = []

    def change(rows):
        given = getattr(rows, field)
        kept.append(given[0, 1:]) if not kept else None
        repeated = given.copy()
        repeated[:, 1:] = kept[0]
        return rows._replace(**{field: repeated})

    return change


def scaled(field, columns, factor):
    """Return a change of the scale of some columns."""

    def change(rows):
        wrong = getattr(rows, field).copy()
        wrong[:, columns] *= factor
        return rows._replace(**{field: wrong})

    return change


@pytest.mark.parametrize("resolution", [0.0, 0.01, 0.05])
@pytest.mark.parametrize("motion", [{"speed": 0.0}, {}, {"turn": 0.4}, {"turn": -0.4}])
def test_healthy_senses_are_believed_whatever_their_resolution(resolution, motion):
    """At rest, straight on and in a turn, with noise, or with rows that are equal for seconds."""
    check, senses = fresh(), Senses(resolution)
    begun = drive(check, senses, 3.0, speed=0.0)
    assert not any(begun + drive(check, senses, 12.0, **motion))
    assert check.warnings(senses.now) == ()
    assert not check.unused


@pytest.mark.parametrize(("field", "name", "limit"), [("imu", "imu", 0.6), ("mag", "compass", 0.6)])
def test_a_sense_of_noise_that_repeats_itself_hangs(field, name, limit):
    """It is flagged after half a second of a drive straight on, and believed when it changes."""
    check, senses = fresh(), Senses()
    drive(check, senses, 3.0)
    found = drive(check, senses, 2.0, hanging(field))
    assert flagged(found) == pytest.approx(limit, abs=0.11)
    assert found[-1] == {name: Doubt.REPEATED}
    (text,) = check.warnings(senses.now)
    assert text.startswith(f"{name}: repeats its last row")
    assert text.endswith(", for 2.0 s") or text.endswith(", for 1.9 s")
    assert check.unused[name]["repeated"] >= 130
    assert not any(drive(check, senses, 1.0)[1:])


@pytest.mark.parametrize("field", ["imu", "mag"])
def test_a_sense_that_repeats_itself_at_rest_hangs_in_no_straight_drive(field):
    """A robot that stands proves nothing; who held still there may be coarse."""
    check, senses = fresh(), Senses()
    drive(check, senses, 3.0)
    hang = hanging(field)
    assert not any(drive(check, senses, 5.0, hang, speed=0.0))
    assert not any(drive(check, senses, 2.0, hang))


def test_a_coarse_compass_that_hangs_is_found_in_a_turn():
    """One degree or ten: in a turn of 0.15 rad every compass changes."""
    check, senses = fresh(), Senses(resolution=0.05)
    drive(check, senses, 3.0, speed=0.0)
    found = drive(check, senses, 2.0, hanging("mag"), turn=0.4)
    assert 0.3 <= flagged(found) <= 0.7
    assert found[-1] == {"compass": Doubt.REPEATED}


def test_encoders_that_repeat_themselves_while_the_gyro_changes_hang():
    """Equal rows of a straight drive are no fault, those of a drive that begins to turn are."""
    check, senses = fresh(), Senses()
    hang = hanging("wheels")
    assert not any(drive(check, senses, 5.0, hang))
    found = drive(check, senses, 2.0, hang, turn=0.4)
    assert flagged(found) <= 1.5
    assert "wheels" in found[-1]


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (scaled("imu", slice(1, 4), 2.0), {"imu": Doubt.SCALE}),
        (scaled("wheels", slice(1, 3), 2.0), {"wheels": Doubt.SCALE}),
        (scaled("wheels", slice(1, 3), 10.0), {"wheels": Doubt.SCALE}),
        (scaled("wheels", slice(1, 3), 0.0), {"wheels": Doubt.SCALE}),
        (scaled("imu", slice(4, 7), 2.0), {"gravity": Doubt.SCALE}),
        (scaled("imu", slice(4, 7), 0.5), {"gravity": Doubt.SCALE}),
    ],
)
def test_a_scale_is_judged_by_the_two_other_senses(change, expected):
    """Within 1.2 s of a turn on the spot; a turn with the right scale acquits."""
    check, senses = fresh(), Senses()
    drive(check, senses, 2.0)
    drive(check, senses, 6.0, speed=0.0, turn=0.4)
    found = drive(check, senses, 2.5, change, speed=0.0, turn=0.4)
    assert flagged(found) <= 1.2
    assert found[-1] == expected
    (name,) = expected
    assert check.unused[name]["out of scale"] >= 5
    assert drive(check, senses, 12.0, speed=0.0, turn=0.4)[-1] == {}


def test_an_accelerometer_out_of_scale_leaves_the_gyro():
    """The specific force is unknown then, and the rows of the source stay as they were."""
    check, senses = fresh(), Senses()
    drive(check, senses, 1.0, scaled("imu", slice(4, 7), 2.0))
    rows, begin = senses.rows(), senses.now - 0.1
    believed = check.believed(senses.now, begin, rows, LEVEL)
    assert np.isnan(believed.imu[:, 4:]).all()
    np.testing.assert_array_equal(believed.imu[:, :4], rows.imu[:, :4])
    assert np.isfinite(rows.imu).all()


@pytest.mark.parametrize(("lacking", "field"), [("mag", "wheels"), ("wheels", "imu")])
def test_without_a_third_sense_no_scale_is_judged(lacking, field):
    """Two that contradict each other do not say who is wrong."""
    check, senses = fresh(), Senses()
    drive(check, senses, 2.0)
    drive(check, senses, 6.0, speed=0.0, turn=0.4)
    wrong, dumb = scaled(field, slice(1, 4), 2.0), scaled(lacking, slice(1, None), np.nan)
    drive(check, senses, 7.0, dumb, speed=0.0, turn=0.4)
    assert not any(drive(check, senses, 8.0, lambda rows: wrong(dumb(rows)), speed=0.0, turn=0.4))


def test_turns_to_and_fro_are_no_proof_of_a_scale():
    """Wheels that turn less far to one side, as on a slope, are believed whatever the sum is."""
    check, senses = fresh(), Senses()
    drive(check, senses, 2.0)
    drive(check, senses, 8.0, turn=0.4)

    def one_sided(rows):
        wrong = rows.wheels.copy()
        difference = (wrong[:, 2] - wrong[:, 1]) / 2
        loss = np.where(difference < 0, 0.3, 0.0) * difference
        wrong[:, 1:] += np.stack([loss, -loss], axis=1)
        return rows._replace(wheels=wrong)

    for _ in range(6):
        assert not any(drive(check, senses, 1.0, one_sided, turn=-0.6))
        assert not any(drive(check, senses, 1.0, one_sided, turn=0.6))


def test_encoders_that_jump_are_doubted_until_they_come_back():
    """Half a metre a second more from one moment to the next; the count has a reason of its own."""
    check, senses = fresh(), Senses()
    drive(check, senses, 3.0)
    found = drive(check, senses, 2.0, scaled("wheels", slice(1, 3), 2.0))
    assert flagged(found) <= 0.2
    assert found[-1] == {"wheels": Doubt.JUMP}
    (text,) = check.warnings(senses.now)
    assert text.startswith("wheels: change their speed, and the accelerometer feels another change")
    assert check.unused["wheels"]["not as the accelerometer"] >= 180
    assert drive(check, senses, 1.0)[-1] == {}
    assert drive(check, senses, 1.0, scaled("wheels", slice(1, 3), 2.0))[-1] != {}
    check.judge_wheels(False, senses.now - 2.0, senses.now)
    assert drive(check, senses, 0.1, scaled("wheels", slice(1, 3), 2.0)) != [{}]
    check.judge_wheels(False, senses.now, senses.now)
    assert drive(check, senses, 0.1) == [{}]


def test_a_wrong_track_is_no_fault_of_the_wheels():
    """Wheels that turn twice as far per turn from the beginning have another track."""
    check, senses = fresh(), Senses()
    assert not any(drive(check, senses, 20.0, scaled("wheels", slice(1, 3), 2.0), turn=0.4))


@pytest.mark.parametrize(("field", "name"), [("wheels", "wheels"), ("mag", "compass")])
def test_rows_that_are_old_or_out_of_order_are_stale(field, name):
    """A second before the state is the limit; a row has to be newer than the one before it."""
    check, senses = fresh(), Senses()
    rows = senses.rows()
    given = getattr(rows, field)
    given[:7, 0] = [-1000.0, 0.99, 1.01, 2.06, 2.05, 2.07, 2.07]
    before = given.copy()
    rows = SenseRows(rows.imu, np.empty((0, 3)), np.empty((0, 4)))._replace(**{field: given[:7]})
    believed = check.believed(2.1, 2.0, rows, LEVEL)
    assert getattr(believed, field)[:, 0].tolist() == [1.01, 2.06, 2.07]
    assert check.unused == {name: {STALE: 4}}
    np.testing.assert_array_equal(given, before)


def test_fixes_judge_the_wheels_and_what_they_said_before_acquits_nobody():
    """A doubt by the fixes lasts until they agree in a comparison that began after it."""
    check = fresh()
    check.judge_wheels(False, 0.0, 10.0)
    check.judge_wheels(True, 0.0, 10.0)
    check.judge_wheels(False, 9.0, 12.0)
    check.believed(12.1, 12.0, Senses().rows(), LEVEL)
    assert check.doubts == {"wheels": Doubt.SCALE}
    assert check.warnings(14.0) == ("wheels: contradict gyro and compass, or the fixes, for 4.0 s",)
    check.judge_wheels(False, 10.0, 13.0)
    check.believed(13.1, 13.0, Senses().rows(), LEVEL)
    assert check.doubts == {}


def test_the_way_is_that_of_the_wheels_in_the_maps_axes():
    """Half a metre a second for ten seconds to the north-east."""
    check, senses, x = fresh(), Senses(), LEVEL.copy()
    x[2] = np.pi / 4
    for _ in range(100):
        check.believed(senses.now + 0.1, senses.now, senses.rows(), x)
    np.testing.assert_allclose(check.way, 5.0 * np.sqrt(0.5), rtol=1e-9)
    check.reset(senses.now)
    assert check.way.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_force_that_is_invalid_is_counted_by_its_reason(bad):
    """The row goes on for its gyro; a row without any force, or a bad gyro, is no such row."""
    check, senses = fresh(), Senses()
    check.reset(0.0)
    rows = senses.rows()
    rows.imu[1, 5] = rows.imu[2, 4] = bad
    rows.imu[3, 4:] = np.nan
    rows.imu[4, 2] = rows.imu[4, 4] = bad
    believed = check.believed(senses.now, 0.0, rows, LEVEL)
    assert np.array_equal(believed.imu, rows.imu, equal_nan=True)
    assert check.unused["gravity"] == {INVALID: 2}
    assert check.doubts == {}
