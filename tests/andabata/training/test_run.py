"""Training runs in a folder: the same seed gives the same bytes, a kill costs nothing."""

import hashlib
import json
import shutil

import pytest

from andabata.app.cli import main
from andabata.configuration.settings import resolve
from andabata.engine_processes import ProcessEngine
from andabata.models import Models
from andabata.tasks.rooms.config import JudgingRoomError
from andabata.training.plans import TrainingPlan, load_plan
from andabata.training.run import CHECKPOINT, HISTORY, POLICY, learn, read_history
from rl.policy import load_policy


def small_plan():
    overrides = ["validation=1", "learner.hidden=[16, 16]", "learner.episodes_per_iteration=2"]
    overrides += ["learner.batch_size=16", "stages.Natural.rehearsal=0.5"]
    for name, episodes, limit in (("Maze2D", 4, 4.0), ("Maze3D", 2, 3.0), ("Natural", 2, 3.0)):
        overrides += [
            f"stages.{name}.episodes={episodes}",
            f"stages.{name}.environment.seeds=[0, 1]",
            f"stages.{name}.environment.terminations.time_limit={limit}",
        ]
    return resolve(TrainingPlan, overrides=overrides, base=load_plan())


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the folder and the figures of a run of two stages that was not interrupted."""
    folder = tmp_path_factory.mktemp("run") / "whole"
    return folder, learn(folder, small_plan(), range(2), 5)


def test_a_stage_in_a_room_that_judges_is_refused_before_its_folder_is_full(tmp_path):
    """A plan that was changed without a check is checked by the run itself."""
    plan = load_plan("sac-1d", task="spn")
    stage = plan.stages["Rooms"]
    rooms = stage.environment.model_copy(update={"rooms": ("spn-env0", "spn-env6")})
    stages = {"Rooms": stage.model_copy(update={"environment": rooms})}
    with pytest.raises(JudgingRoomError, match="got spn-env6, for judging alone"):
        learn(tmp_path, plan.model_copy(update={"stages": stages}), range(1), 0)
    assert not (tmp_path / CHECKPOINT).exists()


def same_files(first, second):
    for name in (CHECKPOINT, POLICY, HISTORY, "policy_Maze2D.safetensors"):
        assert (first / name).read_bytes() == (second / name).read_bytes(), name


def test_a_killed_training_ends_with_the_same_bytes(whole, tmp_path):
    """A run that was killed and resumed leaves the same checkpoint, policies and history."""
    config, (folder, figures) = small_plan(), whole
    killed = tmp_path / "killed"

    def kill(iteration):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        learn(killed, config, range(2), 5, on_iteration=kill)
    with pytest.raises(ValueError, match="expected an empty folder, got a run"):
        learn(killed, config, range(2), 5)
    again = learn(killed, config, range(2), 5, resume=True)
    same_files(folder, killed)
    assert (again["stage"], again["episodes"]) == (figures["stage"], figures["episodes"])


def test_the_number_of_workers_changes_no_byte(whole, tmp_path):
    """Two processes leave the same checkpoint, policies and history as one."""
    folder, _ = whole
    with ProcessEngine(2) as engine:
        learn(tmp_path / "two", small_plan(), range(2), 5, engine=engine)
    same_files(folder, tmp_path / "two")


def test_a_policy_knows_how_it_was_trained(whole):
    """Stage, settings, seed and models are in the file of each stage's policy."""
    folder, _ = whole
    for name, stage in ((POLICY, "Maze3D"), ("policy_Maze2D.safetensors", "Maze2D")):
        policy = load_policy(folder / name)
        assert policy.info["stage"] == stage
        assert policy.info["config"]["learner"]["hidden"] == [16, 16]
        assert policy.info["seed"] == 5
        assert policy.info["stages"] == [0, 2]
        assert policy.info["forest"] == Models().hashes["forest"]
        assert policy.observations.size == 35


def test_the_folder_tells_the_run(whole):
    """The history has a line an iteration, the summary is that of its last."""
    folder, figures = whole
    history = read_history(folder / HISTORY)
    assert [row["name"] for row in history] == ["Maze2D", "Maze2D", "Maze3D"]
    assert [row["is_last"] for row in history] == [False, True, True]
    assert figures["stage"] == "Maze3D"
    assert figures["episodes"] == 2
    assert figures["steps"] == history[-1]["steps"] > 60
    assert figures["success_rate"] == history[-1]["recent_success"]
    assert set(figures["validation"]) == {"Maze2D", "Maze3D"}
    described = json.loads((folder / "run.json").read_text())
    assert (described["verb"], described["seed"], described["stages"]) == ("train", 5, [0, 2])


def changed_head(folder, **changes):
    """Change the description of a run in its folder."""
    path = folder / "run.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def test_another_run_is_not_resumed(whole, tmp_path):
    """Other settings, seed, stages, models or code are refused, each by its name."""
    folder = tmp_path / "run"
    shutil.copytree(whole[0], folder)
    plan = small_plan()
    other = resolve(TrainingPlan, overrides=["learner.gamma=0.5"], base=plan)
    with pytest.raises(ValueError, match=r"config\.learner\.gamma: expected 0.98, .* got 0.5"):
        learn(folder, other, range(2), 5, resume=True)
    with pytest.raises(ValueError, match="seed: expected 5, as it began, got 6"):
        learn(folder, plan, range(2), 6, resume=True)
    with pytest.raises(ValueError, match=r"stages: expected \[0, 2\], as it began, got \[0, 1\]"):
        learn(folder, plan, range(1), 5, resume=True)
    for name in ("forest", "ground_classifier", "commit"):
        shutil.copy(whole[0] / "run.json", folder / "run.json")
        changed_head(folder, **{name: "another"})
        with pytest.raises(ValueError, match=f"{name}: expected another, .* --changed goes on"):
            learn(folder, plan, range(2), 5, resume=True)
    figures = learn(folder, plan, range(2), 5, resume=True, changed=True)
    assert figures["episodes"] == 2  # It had ended: nothing was left to play.
    same_files(whole[0], folder)


def test_a_reward_of_ones_own_is_in_the_run_and_not_changed_in_the_middle(tmp_path):
    """The digest of its file stands in ``run.json``; a resume with another content is refused."""
    file, folder = tmp_path / "own.py", tmp_path / "run"
    file.write_text("def near(step):\n    return {'near': -step.distance}\n")
    overrides = [f"stages.Maze2D.environment.reward.function={file}:near", "validation=0"]
    plan = resolve(TrainingPlan, overrides=overrides, base=small_plan())
    learn(folder, plan, range(1), 5)
    assert {name for row in read_history(folder / HISTORY) for name in row["terms"]} == {"near"}
    described = json.loads((folder / "run.json").read_text())
    assert described["own"] == {str(file): hashlib.sha256(file.read_bytes()).hexdigest()}
    file.write_text("def near(step):\n    return {'near': step.distance}\n")
    with pytest.raises(ValueError, match=r"own: expected .*own\.py.* --changed goes on"):
        learn(folder, plan, range(1), 5, resume=True)


def test_nothing_to_resume_is_an_error(tmp_path):
    """Without a run in the folder ``--resume`` fails."""
    assert main(["train", "--resume", "--out", str(tmp_path / "none"), "--quiet"]) == 1
