"""Senses that lie: drives with a fault of each sense and kind, fixes that jump or fall silent.

The limits are those of the promises; a fault that is not flagged in time is a failure, also where
it cannot be observed, such as ranges that are all longer by a share.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench.studies.soak.missing_input import command_of
from andabata.bench.studies.soak.outcome import Outcome, Tally
from andabata.bench.studies.soak.synthetic_drive import (
    PERIOD,
    SPEED,
    fresh_localizer,
    synthetic_place,
    synthetic_readings,
)
from andabata.localization.localizer import Health
from andabata.machine.fault_injector import FaultInjector
from andabata.machine.faults import KINDS, SENSES, Fault, typical_value
from andabata.models import Models
from andabata.navigation.fault_watch import FaultResponse, FaultWatch
from worlds.scenes import SceneCache
from worlds.splits import DEVELOPMENT_SEEDS
from worlds.world import choose_task, jittered

_ONSET, _LASTS = 15.0, 15.0
"""Time of the fault from the start of a drive, and time that is driven with it [s]."""

_SOON = 2.0
"""Time within which a fault is flagged [s]."""

JUMPS = (20.0, 500.0, 10_000.0)
"""Sizes of the jumps of fixes [m]."""

_JUMP_ONSET, _JUMP_LASTS, _JUMP_END = 60.0, 15.0, 90.0
"""Begin and duration of a jump, and end of its drive [s]."""

_DEGRADED = 2.5
"""Time within which missing fixes degrade the health [s]."""

_STRAIGHT = 1e5
"""Radius of a drive that is as good as straight [m]: its error across the way grows."""

_LOST_BY = 3_600.0
"""Time within which a robot without fixes is lost by its covariance [s]."""

_STANDS = 10.0
"""Time that a lost robot has to stand before fixes arrive again [s]."""

_WAY_OUT = 60.0
"""Time with fixes again within which the health is ok [s]."""


def faults_of_senses(count: int) -> Iterator[tuple[Fault, int]]:
    """Yield typical faults of all kinds and senses with a world's seed, round after round."""
    pairs = [(sense, kind) for kind in KINDS for sense in SENSES]
    for number in range(count):
        turn, place = divmod(number, len(pairs))
        sense, kind = pairs[place]
        fault = Fault(sense, kind, typical_value(sense, kind), _ONSET)
        yield fault, DEVELOPMENT_SEEDS[turn % len(DEVELOPMENT_SEEDS)]


def faults_of_senses_are_flagged(count: int, folder: Path) -> Outcome:
    """Check that faults are flagged in time, and lead to no contact and no bad command.

    Development worlds, plant ``kinematic``, planner.

    Args:
        count: Number of drives; every 40 there is one of each kind of each sense.
        folder: Folder for its files; none are made.
    """
    tally, models, scenes = Tally(), Models(), SceneCache(1)
    flags, contacts, bad = 0, 0, 0
    for fault, seed in faults_of_senses(count):
        with tally.guarded(f"{fault}, world {seed}"):
            response = _response(fault, seed, models, scenes)
            tally.trials += 1
            flagged, contact = response.is_flagged_within(_SOON), response.contact_after_s
            flags, contacts = flags + flagged, contacts + (contact is not None)
            bad += response.bad_commands
            after = response.flagged_after_s
            tally.expect(flagged, f"{fault}, world {seed}: flagged after {after} s")
            tally.expect(contact is None, f"{fault}, world {seed}: contact after {contact} s")
            tally.expect(
                not response.bad_commands,
                f"{fault}, world {seed}: {response.bad_commands} commands out of range",
            )
    return tally.outcome(
        f"{flags} of {tally.trials} flagged within {_SOON:.0f} s, {contacts} contacts, {bad} bad "
        "commands"
    )


def _response(fault: Fault, seed: int, models: Models, scenes: SceneCache) -> FaultResponse:
    """Drive in a world until a time after the onset of a fault; return the robot's response."""
    config = SimulatedRobotConfig(plant="kinematic", faults=(fault,))
    scene = scenes.get("natural-test", seed)
    task, rng = choose_task(scene.world.tasks, 0), np.random.default_rng([seed, 1])
    steering = make_steering("planner", scene.world, config, models)
    robot = SimulatedRobot(scene, config, models, steering)
    watch = FaultWatch.of((fault,), robot.localizer, config.robot)
    robot.navigator.spectators.append(watch)
    try:
        readings = robot.place(jittered(task.start, rng), np.array(task.goals[0]), rng)
        has_contact = False
        while readings.stamp < _ONSET + _LASTS and not has_contact:
            readings = robot.step(readings)
            assert readings.truth is not None
            has_contact = readings.truth.collided or readings.truth.tipped
    finally:
        robot.close()
    return watch.response(has_contact)


def jumps_of_fixes_move_nothing(count: int, folder: Path) -> Outcome:
    """Check that fixes that jump are flagged, move nothing, and are accepted again afterwards.

    Args:
        count: Number of drives for each size of a jump.
        folder: Folder for its files; none are made.
    """
    tally, largest = Tally(), 0.0
    for size in JUMPS:
        for seed in range(count):
            tally.trials += 1
            error, text = _jump(size, 9000 + seed)
            largest = max(largest, error)
            tally.expect(not text, f"jump of {size:.0f} m, seed {9000 + seed}: {text}")
    return tally.outcome(f"error at most {largest:.2f} m in {tally.trials:,} jumps")


def _jump(size: float, seed: int) -> tuple[float, str]:
    """Return the largest error of a drive whose fixes jump [m], and what was wrong, if anything."""
    inject = FaultInjector(
        [Fault("gnss", "jump", size, _JUMP_ONSET, _JUMP_LASTS)], np.random.default_rng(seed)
    )
    localizer, largest, jumped, good, accepted = fresh_localizer(), 0.0, 0, 0, 0
    for readings in synthetic_readings(round(_JUMP_END / PERIOD), seed=seed):
        had_fix, before = readings.gnss is not None, localizer.counts["gnss"][0]
        localizer.update(inject(readings))
        stamp, is_accepted = readings.stamp, localizer.counts["gnss"][0] > before
        if stamp < _JUMP_ONSET:
            continue
        away = localizer.pose.position[:2] - synthetic_place(stamp)
        largest = max(largest, float(np.hypot(*away)))
        if largest > 1.0 + 0.02 * SPEED * stamp:
            return largest, f"off by {largest:.2f} m at {stamp:.1f} s"
        if had_fix and stamp < _JUMP_ONSET + _JUMP_LASTS - PERIOD / 2:
            jumped += 1
            if localizer.health is Health.OK:
                return largest, f"health ok after {jumped} fixes"
        elif had_fix:
            good, accepted = good + 1, accepted + is_accepted
            if good == 2 and not accepted:
                return largest, "not accepted again within 2 fixes"
    return largest, ""


def lost_fixes_stop_the_robot(count: int, folder: Path) -> Outcome:
    """Check what becomes of a robot without fixes: degraded, lost, standing, and well again.

    Args:
        count: Number of drives, each with another seed.
        folder: Folder for its files; none are made.
    """
    tally, longest, times = Tally(), 0.0, list[float]()
    for seed in range(9000, 9000 + count):
        tally.trials += 1
        degraded, lost, text = _loss(seed)
        longest, times = max(longest, degraded), [*times, lost]
        tally.expect(not text, f"seed {seed}: {text}")
    return tally.outcome(
        f"degraded within {longest:.1f} s, lost after {min(times):.0f} to {max(times):.0f} s"
    )


def _loss(seed: int) -> tuple[float, float, str]:
    """Return the times until a drive without fixes is degraded and lost [s], and what was wrong."""
    localizer, begin = fresh_localizer(_STRAIGHT), 30.0 + 0.1 * (seed % 10)
    navigator = command_of(localizer)
    degraded = lost = np.inf
    for readings in synthetic_readings(round(_LOST_BY / PERIOD), seed=seed, radius=_STRAIGHT):
        after = readings.stamp - begin
        is_missing = 0.0 <= after < lost + _STANDS
        localizer.update(replace(readings, gnss=None) if is_missing else readings)
        health, moves = localizer.health, navigator() != 0.0
        if health is Health.LOST:
            lost = min(lost, after)
        elif health is Health.DEGRADED and after >= 0.0:
            degraded = min(degraded, after)
        if after > _DEGRADED and degraded > _DEGRADED:
            return degraded, lost, f"not degraded within {_DEGRADED} s"
        if degraded < after < lost + _STANDS and health is Health.OK:
            return degraded, lost, f"ok again without fixes, after {after:.1f} s"
        if lost + 1.0 < after < lost + _STANDS and moves:
            return degraded, lost, f"drives {after - lost:.1f} s after it is lost"
        if after > lost + _STANDS and health is Health.OK:
            return degraded, lost, ""
        if after > lost + _STANDS + _WAY_OUT:
            return degraded, lost, f"not ok with fixes again for {_WAY_OUT:.0f} s"
    return degraded, lost, f"never lost in {_LOST_BY:.0f} s"
