"""One drive, from a world's name to a path, and its recording."""

import errno
import json
import sqlite3
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.app.options.recording import RecordingOptions
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.evaluation.attempt import Attempt
from andabata.evaluation.drive import Driven, Recording, drive_once
from andabata.evaluation.strict_verdict import StrictMeasures
from andabata.evaluation.trial import OffroadMeasures
from andabata.localization.noisy_ground_truth import NoisyGroundTruthConfig
from andabata.machine.faults import Fault
from andabata.machine.planar.mover_contact import Contact
from andabata.machine.simulator import SensingConfig
from andabata.replay.replay import replay_bag
from andabata.tasks.episode_monitor import Outcome
from tests.support.walking_worlds import agent, peopled, walker
from worlds.splits import evaluation_world
from worlds.world import Start, Task

CONFIG = SimulatedRobotConfig(
    plant="kinematic", localizer="truth", sensing=SensingConfig(scanner="horizontal")
)


def short(seed=0, **others):
    return drive_once("maze", seed, "straight", CONFIG, time_limit=3.0, **others)


def test_the_seed_gives_the_drive():
    """The world is one that nothing trains on, and the same seed gives the same path."""
    first, again, other = short(), short(), short(1)
    assert first.world.seed == evaluation_world(0, 0)
    assert other.world.seed == evaluation_world(1, 0)
    np.testing.assert_array_equal(first.path, again.path)
    assert not np.array_equal(first.path[0], other.path[0])
    assert first.cloud is None


def test_estimate_and_truth_are_compared_at_the_same_time():
    """An estimate that is the truth has no error, although the robot moves on."""
    exact = NoisyGroundTruthConfig(position_sigma=0.0, yaw_sigma=0.0, tilt_sigma=0.0)
    config = CONFIG.model_copy(update={"errors": exact})
    driven = drive_once("maze", 0, "straight", config, time_limit=3.0)
    assert driven.path[0] != pytest.approx(driven.path[-1])
    assert driven.estimate["position_max_m"] == 0.0
    assert driven.estimate["heading_rms_rad"] == 0.0
    assert driven.estimate["health_s"] == {"ok": 3.0}
    errors = [row[driven.trace["columns"].index("pose_error_m")] for row in driven.trace["rows"]]
    assert not any(errors)
    assert driven.as_dict()["estimate"] == driven.estimate


def test_the_time_limit_is_that_of_each_goal():
    """A drive ends at its limit, and each simulated second is reported."""
    seconds = []
    driven = short(on_second=lambda: seconds.append(1))
    assert [attempt.outcome for attempt in driven.attempts] == [Outcome.TIMEOUT]
    assert driven.attempts[0].time == pytest.approx(3.0)
    assert len(seconds) == 3
    assert (
        driven.title == f"straight in maze {driven.world.seed}: 0 of {len(driven.task.goals)} goals"
    )


def test_own_goals_take_the_place_of_the_worlds():
    """The robot starts at the world's start and drives to the goals in their order."""
    driven = short()
    x, y = driven.task.start.x, driven.task.start.y
    own = short(goals=((x, y), *driven.task.goals))
    assert own.task.start == driven.task.start
    assert own.task.goals == ((x, y), *driven.task.goals)
    assert [one.outcome for one in own.attempts] == [Outcome.GOAL, Outcome.TIMEOUT]


def test_the_command_refuses_a_goal_outside(capsys):
    """One line that names the bounds, and the exit code of a wrong option."""
    assert main(["drive", "--world", "maze", "--goal", "500,0", "--quiet"]) == 2
    assert "expected a place that a safe path leads to" in capsys.readouterr().err
    assert main(["drive", "--goal", "5"]) == 2
    assert "--goal: expected 2 numbers" in capsys.readouterr().err


def attempt(goal, outcome):
    measures = OffroadMeasures(
        goal=goal,
        goals=2,
        goal_place=(goal, 0.0),
        end=(goal, 1.23456),
        world_seed=0,
        difficulty=0.0,
        cause="",
        forbidden_distance=0.25,
        steering_variation=0.5,
        energy=None,
        min_clearance=0.75,
        arrival_error=0.5,
        position_error=0.25,
        strict=StrictMeasures(0.1, None),
    )
    path = np.array([[goal, 0.0, 0.0], [goal, 1.23456, 0.0]])
    return Attempt("policy", "made", 0, outcome, Contact.NONE, 10.0, 4.0, 2.0, measures, path)


@pytest.mark.parametrize(
    ("outcomes", "success"),
    [
        ((Outcome.GOAL, Outcome.GOAL), True),
        ((Outcome.GOAL, Outcome.STUCK), False),
        ((Outcome.GOAL,), False),
        ((Outcome.COLLISION,), False),
    ],
)
def test_a_drive_succeeds_with_its_last_goal(make_ground, outcomes, success):
    """Success needs every goal of the task; attempts are listed with their measures."""
    task = Task(Start(0.0, 0.0, 0.0), ((1.0, 0.0), (2.0, 0.0)))
    attempts = tuple(attempt(k, one) for k, one in enumerate(outcomes, start=1))
    data = Driven(make_ground(), task, "policy", attempts, None).as_dict()
    assert data["success"] is success
    assert json.loads(json.dumps(data)) == data
    assert (data["controller"], data["world"], data["world_seed"]) == ("policy", "made", 0)
    assert data["goals"] == [[1.0, 0.0], [2.0, 0.0]]
    assert len(data["attempts"]) == len(outcomes)
    assert data["attempts"][0] == {
        "goal": 1,
        "outcome": str(outcomes[0]),
        "contact": "",
        "time_s": 10.0,
        "distance_m": 4.0,
        "shortest_m": 2.0,
        "spl": 0.5 if outcomes[0] is Outcome.GOAL else 0.0,
        "trespass_m": 0.25,
        "min_clearance_m": 0.75,
        "arrival_error_m": 0.5,
        "position_error_m": 0.25,
        "overridden_share": None,
        "strict": outcomes[0] is Outcome.GOAL,
        "strict_failure": "",
        "outline_forbidden_s": 0.1,
        "solid_distance_m": None,
    }
    assert data["path"][:2] == [[1.0, 0.0, 0.0], [1.0, 1.235, 0.0]]
    assert len(data["path"]) == 2 * len(outcomes)


def test_a_drive_lists_where_walkers_were(make_ground):
    """Size and stamped path of each, without the seconds in which it was not there."""
    rows = np.zeros((3, 2, 5))
    rows[:, 0] = [
        [1.0, 2.0, 0.5, 0.25, 1.7],
        [2.0, 2.0, 0.5, 0.25, 1.7],
        [3.0, 2.0, 0.5, 0.25, 1.7],
    ]
    rows[1, 1] = 4.0, 4.123, 0.0, 0.2, 1.6
    task = Task(Start(0.0, 0.0, 0.0), ((1.0, 0.0),))
    hit = replace(attempt(1, Outcome.COLLISION), contact=Contact.HIT_AT_REST)
    world = peopled(make_ground(), agent("person", (1.0, 2.0)), walker((4.0, 4.0)))
    data = Driven(world, task, "policy", (hit,), None, rows).as_dict()
    assert json.loads(json.dumps(data)) == data
    assert data["attempts"][0]["contact"] == "hit_at_rest"
    assert "walker" not in data["attempts"][0]
    named = replace(hit, detail=replace(hit.detail, walker="vehicle"))
    data = Driven(world, task, "policy", (named,), None, rows).as_dict()
    assert data["attempts"][0]["walker"] == "vehicle"
    assert [one["stamped_path"] for one in data["walkers"]] == [
        [[0.0, 1.0, 2.0, 0.5], [1.0, 2.0, 2.0, 0.5], [2.0, 3.0, 2.0, 0.5]],
        [[1.0, 4.0, 4.12, 0.0]],
    ]
    assert [one["radius_m"] for one in data["walkers"]] == [0.25, 0.2]
    assert [one["kind"] for one in data["walkers"]] == ["person", "walker"]


def test_a_recorded_drive_is_the_same_drive(tmp_path):
    """Recording changes nothing, and writes a bag that knows its world, seed and controller."""
    path = tmp_path / "drive.mcap"
    recorded = short(record=Recording(path, clouds=False))
    np.testing.assert_array_equal(recorded.path, short().path)
    manifest = json.loads(next(tmp_path.glob("*.json")).read_text())
    assert (manifest["world"], manifest["seed"], manifest["controller"]) == ("maze", 0, "straight")
    assert path.stat().st_size > 1000


def test_a_drive_with_faults_says_what_the_robot_made_of_them():
    """The faults, from the first onset on; without any there is nothing to say."""
    faulty = CONFIG.model_copy(update={"faults": (Fault("laser", "off", None, 1.0),)})
    driven = drive_once("maze", 0, "straight", faulty, time_limit=3.0)
    assert driven.faults == {
        **{"injected": ["laser:off@1"], "faulty_s": 2.0, "flagged_after_s": 0.3},
        **{"bad_commands": 0, "health_at_end": "degraded", "contact_after_s": None},
    }
    assert driven.as_dict()["faults"] == driven.faults
    plain = drive_once("maze", 0, "straight", CONFIG, time_limit=3.0)
    assert plain.faults is None
    # The laser is silent from the period on that ends at 1.0 s.
    np.testing.assert_array_equal(driven.path[:10], plain.path[:10])
    assert driven.attempts[0].distance < plain.attempts[0].distance - 0.4


def test_a_recording_has_the_readings_with_their_faults(tmp_path):
    """Its replay adds none, and gives the same commands; it may add others."""
    path = tmp_path / "drive.mcap"
    texts = ("gnss:jump=50@2", "wheels:off@3+2", "laser:slow=0.5@4")
    faults = tuple(map(Fault.parse, texts))
    config = SimulatedRobotConfig(plant="kinematic", faults=faults)
    record = Recording(path, clouds=False, local_map=False)
    driven = drive_once("hill", 7302, "reactive", config, record=record, time_limit=6.0)
    assert driven.faults["flagged_after_s"] is not None
    same = replay_bag(path)
    assert (same["differing_scans"], same["differing_commands"], same["faults"]) == (0, 0, None)
    assert same["scans"] > 10
    more = replay_bag(path, RecordingOptions().replay(faults=[Fault.parse("imu:off@1+3")]))
    assert more["faults"]["injected"] == ["imu:off@1+3"]
    assert more["faults"]["flagged_after_s"] == pytest.approx(0.1, abs=0.11)
    assert more["differing_commands"] + more["differing_scans"] > 0


def test_the_command_draws_a_drive(capsys, tmp_path):
    """The oracle arrives without forbidden ground; path, picture and settings are written."""
    words = ["drive", "--world", "maze", "--controller", "oracle", "--set", "plant=kinematic"]
    words += ["--set", "sensing.scanner=horizontal", "--out", str(tmp_path / "drive"), "--json"]
    assert main(words) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1  # One JSON object and nothing else.
    data = json.loads(out)
    assert data["success"]
    assert data["attempts"][0]["trespass_m"] == 0.0
    assert (tmp_path / "drive/drive.png").stat().st_size > 10_000
    assert json.loads((tmp_path / "drive/run.json").read_text())["config"]["plant"] == "kinematic"


def test_a_full_disk_names_the_recording_and_the_next_step(tmp_path, monkeypatch):
    """Files of ROS 1 and MCAP raise the system's error, sqlite3 its own; others stay."""
    disk = sqlite3.connect(":memory:")
    disk.execute("PRAGMA max_page_count = 1")

    def fill(ending):
        if ending == ".db3":
            disk.execute("CREATE TABLE a (b)")
        raise OSError(errno.ENOSPC, "No space left on device")

    for ending in (".mcap", ".db3"):
        path = tmp_path / f"drive{ending}"
        writer = SimpleNamespace(close=lambda ending=ending: fill(ending))
        monkeypatch.setattr(Recording, "watch", lambda *_, writer=writer: writer)
        with pytest.raises(OSError, match="disk space for the recording, got none") as error:
            short(record=Recording(path))
        assert error.value.filename == str(path)
    disk.close()
    database = sqlite3.connect(":memory:")
    broken = SimpleNamespace(close=lambda: database.execute("nonsense"))
    monkeypatch.setattr(Recording, "watch", lambda *_: broken)
    with pytest.raises(sqlite3.OperationalError, match="syntax error"):
        short(record=Recording(tmp_path / "drive.db3"))
    database.close()
