"""The promises of reliability, each with the numbers of trials of both versions."""

from andabata.bench.studies.soak.promise import Promise

PROMISES = (
    Promise(
        "bad-measurements",
        "bad measurements never reach the state: not finite, huge, a place or a field of zero, a "
        "negative or huge variance; gyro and fixes old or sent again; wheels, compass, fixes ahead",
        "bad_measurements:bad_measurements_change_nothing",
        unit="rows a sense",
        short=1_000,
        full=10_000,
        limit="none, each counted",
    ),
    Promise(
        "gate",
        "the gate rejects what its number says, in 1, 2 and 3 dimensions",
        "filter_laws:gate_rejects_its_share",
        unit="rows",
        short=100_000,
        full=100_000,
        limit="0.001 within 3 sigma: 100 +- 30 of 100,000",
    ),
    Promise(
        "kalman",
        "on a linear problem of several rates the filter is the Kalman filter",
        "filter_laws:filter_is_the_kalman_filter",
        unit="steps",
        short=10_000,
        full=10_000,
        limit="1e-8",
    ),
    Promise(
        "covariance",
        "the covariance stays positive definite, with gaps of compass and fixes",
        "filter_laws:covariance_stays_positive",
        unit="steps",
        short=20_000,
        full=1_000_000,
        limit="above 0",
    ),
    Promise(
        "kills",
        "killed while saving anything, files are whole and of the last interval",
        "saving:kills_leave_whole_files",
        unit="kills",
        short=120,
        full=500,
        limit="0 unreadable, one interval lost",
    ),
    Promise(
        "resume",
        "a training that is cut and goes on ends with the bytes of one that was not",
        "resuming:resumed_trainings_are_equal",
        unit="cuts a plan",
        short=2,
        full=20,
        limit="bit for bit, each plan",
        hours=2.0,
    ),
    Promise(
        "same-bytes",
        "the same seed gives the same bytes in each process, with 1, 2 and 4 workers",
        "same_bytes:same_seed_gives_the_same_bytes",
        unit="processes a command",
        short=2,
        full=9,
        limit="one digest each",
        hours=2.0,
        least=2,
    ),
    Promise(
        "killed-recorder",
        "a killed recorder loses its last second alone",
        "recordings:killed_recorders_lose_a_second",
        unit="kills",
        short=30,
        full=300,
        limit="1 s",
    ),
    Promise(
        "damaged-recordings",
        "damaged recordings are reported, and nothing hangs",
        "recordings:damaged_recordings_are_noticed",
        unit="files a format",
        short=180,
        full=3_600,
        limit="0 foreign errors, 0 hangs, 0 unnoticed",
        hours=2.0,
    ),
    Promise(
        "damaged-clouds",
        "damaged clouds are read, or refused with a named error, in time",
        "damaged_files:damaged_clouds_are_refused",
        unit="files a kind",
        short=1_000,
        full=10_000,
        limit="0 foreign errors, 0 hangs",
    ),
    Promise(
        "damaged-files",
        "other damaged files, too: models, worlds, meshes, rooms, settings, journals, recordings",
        "damaged_files:other_damaged_files_are_refused",
        unit="files a kind",
        short=200,
        full=5_000,
        limit="0 foreign errors, 0 hangs",
        hours=3.0,
    ),
    Promise(
        "fuzzing",
        "readers that are fuzzed, guided by coverage, raise named errors alone, and end",
        "fuzzing:fuzzed_readers_raise_named_errors",
        unit="s in all",
        short=120,
        full=7_200,
        limit="0 foreign errors, 0 hangs",
        hours=4.0,
    ),
    Promise(
        "long-drive",
        "driving on and on takes no more and more memory, and raises no error",
        "driving:long_drives_keep_their_memory",
        unit="s, simulated",
        short=1_800,
        full=86_400,
        limit="50 MB, 0 errors",
        hours=6.0,
    ),
    Promise(
        "interrupts",
        "Ctrl-C and SIGTERM end a command at any moment, with all that it started",
        "driving:interrupted_drives_end",
        unit="commands",
        short=6,
        full=1_000,
        limit="5 s, 0 orphans",
        hours=6.0,
    ),
    Promise(
        "worlds",
        "drives in development worlds, in bullet, reach three goals in a row",
        "worlds:worlds_are_driven",
        unit="worlds",
        short=6,
        full=24,
        limit="22, 22, 20 of 24 and as many misses of fewer",
        least=6,
    ),
)
"""Promises in the order of their table."""


def promise_of(name: str) -> Promise:
    """Return a promise by its name.

    Raises:
        ValueError: If there is none.
    """
    for promise in PROMISES:
        if promise.name == name:
            return promise
    known = ", ".join(promise.name for promise in PROMISES)
    raise ValueError(f"promise: expected one of {known}, got {name!r}")
