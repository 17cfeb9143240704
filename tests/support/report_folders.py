"""Folders of tiny runs of each kind, for tests of reports: driven if that is fast, else written."""

import json

import numpy as np
from PIL import Image

from andabata.app.cli import main
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.configuration.settings import resolve
from andabata.evaluation.drive_trace import TRACE_COLUMNS
from andabata.evaluation.offroad import EvaluationConfig, attempt_of
from andabata.evaluation.offroad_pairs import controller_differences
from andabata.evaluation.offroad_table import failure_causes, summarise
from andabata.report.run_folders import EVALUATION
from andabata.runs.folder import describe
from andabata.training.plans import TrainingPlan, load_plan
from andabata.training.run import HISTORY, learn
from tests.support.room_policies import point_policy, window_policy

WORLDS = ("natural-test", "natural-far")
"""Worlds of the written evaluation."""


def run(*words):
    """Run a command that has to end well."""
    assert main([*map(str, words), "--quiet"]) == 0, words


def made_clouds(folder):
    """Make labelled clouds of two worlds and return their folder."""
    sizes = ["--set", "patch_size=40", "--set", 'presets=["forest","hill"]', "--workers", 1]
    run("clouds", "generate", "--out", folder, "--train", 2, "--validation", 1, *sizes)
    return folder


def made_classifiers(folder, clouds):
    """Train and evaluate small classifiers and return the folders of their scores by name."""
    own = ["--clouds", clouds, "--out"]
    run("classifier", "train", *own, folder / "cells", "--set", "trees=4")
    forest = folder / "cells/forest.npz"
    run("classifier", "evaluate", *own, folder / "again", "--forest", forest)
    run("classifier", "ground", *own, folder / "ground", "--set", "trees=4")
    return {name: folder / name for name in ("cells", "again", "ground")}


def written_drive(folder, controller="planner", seconds=16.0, outcome="timeout"):
    """Write the folder of a drive in an arc and return it."""
    folder.mkdir()
    times = np.arange(0, seconds, 0.1)
    path = np.stack([0.3 * times, 0.01 * times**2, 0 * times], axis=1)
    rows = [
        [t, 0.3 * t, 0.01 * t * t, 0.1 * t, 0.1, 0.3, 0.05, 0.2, 0.01, 0.02, float(t > 8), t]
        for t in times[::5].tolist()
    ]
    columns = [*TRACE_COLUMNS, "unused compass: beyond the gate"]
    attempt = {"goal": 1, "outcome": outcome, "contact": "", "time_s": seconds, "distance_m": 3.6}
    attempt |= {"shortest_m": 9.0, "spl": 0.0, "trespass_m": 0.5, "min_clearance_m": 0.4}
    data = {"controller": controller, "world": "maze", "world_seed": 7, "goals": [[9.0, 1.0]]}
    data |= {"success": False, "attempts": [attempt], "path": path.tolist(), "walkers": []}
    data |= {"trace": {"columns": columns, "rows": rows}, "clip": str(folder / "clip.gif")}
    (folder / "drive.json").write_text(json.dumps(data))
    config = SimulatedRobotConfig().model_dump(mode="json")
    (folder / "run.json").write_text(json.dumps(describe("drive", config, 7300)))
    Image.new("RGB", (32, 20)).save(folder / "clip.gif")
    return folder


def attempt(controller, world, trial, goal, outcome, **changes):
    """Return the row of an attempt."""
    row = {"controller": controller, "trial": trial, "world": world, "world_seed": 40 + trial}
    row |= {"difficulty": 0.2 * trial if world == "natural-far" else None, "goal": goal}
    row |= {"goals": 3, "outcome": outcome, "cause": "" if outcome == "goal" else "rock"}
    row |= {"contact": "", "time_s": 30.0, "distance_m": 10.0, "spl": float(outcome == "goal")}
    row |= {"trespass_m": 0.1, "steering_variation": 2.0, "energy_j": 5000.0}
    row |= {"min_clearance_m": 0.3, "end_xy": [4.0, 2.0], "goal_xy": [8.0, 4.0]}
    return row | {"path": [[0.0, 0.0], [2.0, 0.5], [3.5, 1.5]]} | changes


def written_evaluation(folder, controllers=("planner", "reactive"), picture=(640, 320)):
    """Write the folder of an evaluation whose second controller fails at its second goals."""
    (folder / "failures").mkdir(parents=True)
    config = EvaluationConfig(controllers=controllers, trials=3)
    entries, rows = [], []
    for world in WORLDS:
        for trial in range(3):
            mine = [attempt(controllers[0], world, trial, goal, "goal") for goal in (1, 2, 3)]
            mine.append(attempt(controllers[1], world, trial, 1, "goal"))
            mine.append(attempt(controllers[1], world, trial, 2, "collision"))
            entries.append({"trial": len(entries), "rows": mine})
            rows += mine
            name = f"{world}_{40 + trial}_{controllers[1]}_goal2"
            Image.effect_noise(picture, 90).save(folder / f"failures/{name}.png")
    driven = [attempt_of(row) for row in rows]
    data = {"rows": summarise(driven, controllers), "failures": failure_causes(driven), "seed": 0}
    data["differences"] = controller_differences(driven, controllers)
    data["config"] = config.model_dump(mode="json")
    (folder / EVALUATION).write_text(json.dumps(data, sort_keys=True))
    about = describe("evaluate", data["config"], 0) | {"task": "offroad"}
    (folder / "run.json").write_text(json.dumps(about))
    lines = [json.dumps(one) for one in ({"config": {}}, *entries)]
    (folder / "trials.jsonl").write_text("\n".join(lines) + "\n")
    return folder


def made_barn(folder):
    """Drive a field of cylinders straight ahead, and with a navigator, and return the folder."""
    words = ["--task", "barn", "--controllers", "gap,straight", "--trials", 1, "--workers", 1]
    run("evaluate", *words, "--set", "count=2", "--set", "first_seed=200000", "--out", folder)
    return folder


def made_rooms(folder):
    """Drive rooms and study a laser with a policy that was never trained; return the folders."""
    folder.mkdir()
    file = folder / "policy.safetensors"
    file.write_bytes(point_policy().to_bytes())
    own = ["--policy", file, "--pairs", 1, "--workers", 1, "--out"]
    rooms = ["--rooms", "env0,sudden", "--lidars", "ten-beams", "--memory", "reactive"]
    run("evaluate", "--task", "spn", *rooms, *own, folder / "rooms")
    sets = ("left=[]", "turned=[]", "fov_deg=[]", "max_range=[]", "forward=[0.05]")
    changes = [f"--set={text}" for text in (*sets, "resolution_deg=[]")]
    run("lidar-study", *own, folder / "study", *changes, "--rooms", "random-1")
    return folder / "rooms", folder / "study"


def made_offroad_training(folder):
    """Train for four episodes of the first stage and return the folder."""
    overrides = ["validation=1", "learner.hidden=[16, 16]", "learner.episodes_per_iteration=2"]
    stage = "stages.Maze2D"
    overrides += [f"{stage}.episodes=4", f"{stage}.environment.seeds=[0, 1]"]
    overrides += [f"{stage}.environment.terminations.time_limit=4.0"]
    plan = resolve(TrainingPlan, overrides=overrides, base=load_plan("actor-critic"))
    learn(folder, plan, range(1), 5)
    return folder


def _iteration(steps, episodes, **changes):
    """Return a row of a history."""
    row = {"name": "Rooms", "steps": steps, "episodes": episodes, "mean_steps": 9.0}
    row |= {"played": 50, "is_last": False, "validation": {}, "recent_success": 0.5}
    return row | {"tasks": None} | changes


def _written_training(folder, plan, rows, policy):
    """Write the folder of a training run in rooms and return it."""
    folder.mkdir()
    about = describe("train", plan.model_dump(mode="json"), 0)
    (folder / "run.json").write_text(json.dumps(about | {"forest": "", "ground_classifier": ""}))
    (folder / HISTORY).write_text("".join(json.dumps(row) + "\n" for row in rows))
    (folder / "policy_Rooms.safetensors").write_bytes(policy.to_bytes())
    return folder


def written_spn_training(folder):
    """Write the folder of a training run for SPN in one room and return it."""
    plan = load_plan(task="spn")
    data = plan.model_dump()
    environment = data["stages"]["Rooms"]["environment"]
    environment |= {"rooms": ["spn-env0"]}
    environment["terminations"] |= {"time_limit": 4.0}
    plan = type(plan).model_validate(data)
    tests = [{"steps": [50] * 4, "score": 3.8, "successes": 4}]
    rows = [_iteration(5000, 50, tasks=tests[0]), _iteration(9000, 100, is_last=True)]
    return _written_training(folder, plan, rows, point_policy())


def written_td3_training(folder):
    """Write the folder of a training run for TD3's task and return it."""
    rows = [_iteration(1000 * k, 100 * k, recent_success=0.3 * k) for k in (1, 2, 3)]
    rows[-1] |= {"is_last": True, "validation": {"Rooms": 0.75}}
    return _written_training(folder, load_plan("td3", task="td3"), rows, window_policy())
