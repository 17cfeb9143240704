"""Gymnasium finds the environments as it documents: the package is imported, or named in the id."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
HEAVY = {"torch", "open3d", "pybullet", "numba", "scipy", "sklearn", "matplotlib", "rosbags"}
PLAIN, PREFIXED = "andabata/{}-v0", "andabata:andabata/{}-v0"

ASYNC = """
from functools import partial

import gymnasium as gym
{first}
if __name__ == "__main__":
    for context in ("spawn", "forkserver"):
        envs = gym.vector.AsyncVectorEnv([partial(gym.make, {name!r})], context=context)
        assert [spec.name for spec in envs.get_attr("spec")] == ["Maze2D"]
        envs.close()
    way = {{"vectorization_mode": "async", "vector_kwargs": {{"context": "spawn"}}}}
    envs = gym.make_vec({name!r}, num_envs=1, **way)
    assert [spec.name for spec in envs.get_attr("spec")] == ["Maze2D"]
    envs.close()
"""


def interpreter(*words, folder):
    """Return how a new interpreter ends outside the project, with the kernels of this one."""
    environment = {"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin", "HOME": str(folder)}
    environment["XDG_CACHE_HOME"] = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    command = [sys.executable, *map(str, words)]
    return subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def fresh(*words, folder):
    """Return what an interpreter prints, in which warnings are errors."""
    done = interpreter("-W", "error", *words, folder=folder)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(
    ("first", "pattern"),
    [
        ("import gymnasium as gym, andabata", PLAIN),
        ("import andabata, gymnasium as gym", PLAIN),
        ("import gymnasium as gym", PREFIXED),
    ],
)
def test_every_id_is_made_in_a_fresh_interpreter(tmp_path, first, pattern):
    """Each id makes its environment and its vector environment, whatever is imported first."""
    code = f"""
{first}
for stage in ("Maze2D", "Maze3D", "Natural"):
    name = {pattern!r}.format(stage)
    env = gym.make(name)
    assert env.spec.id == {PLAIN!r}.format(stage), env.spec
    assert env.unwrapped.config.preset == ("natural" if stage == "Natural" else "maze")
    env.close()
    envs = gym.make_vec(name, num_envs=3)
    assert envs.num_envs == 3 and envs.unwrapped.spec.id == env.spec.id
    envs.close()
"""
    fresh("-c", code, folder=tmp_path)


def test_tasks_in_rooms_are_made_in_a_fresh_interpreter(tmp_path):
    """Their ids make one robot and many."""
    code = """
import gymnasium as gym, andabata
for task, config in (("SPN", {"rooms": "spn-env0"}), ("TD3", {"rooms": "clutter-0"})):
    env = gym.make(f"andabata/{task}-v0", **config)
    assert env.unwrapped.config.task == task.lower()
    envs = gym.make_vec(f"andabata/{task}-v0", num_envs=3, **config)
    assert envs.num_envs == 3 and envs.unwrapped.spec.id == env.spec.id
"""
    fresh("-c", code, folder=tmp_path)


@pytest.mark.parametrize(
    ("first", "pattern"), [("import andabata\ngym.register_envs(andabata)", PLAIN), ("", PREFIXED)]
)
def test_processes_that_inherit_nothing_make_them_too(tmp_path, first, pattern):
    """Spawned processes find the ids by the import or by the prefix."""
    script = tmp_path / "robots.py"
    script.write_text(ASYNC.format(first=first, name=pattern.format("Maze2D")))
    fresh(script, folder=tmp_path)


def test_importing_the_package_twice_registers_once_and_imports_nothing_heavy(tmp_path):
    """The import registers without a warning, twice as well, and loads no heavy package."""
    code = f"""
import importlib, sys
import andabata
importlib.reload(andabata)
print(sorted({HEAVY!r} & set(sys.modules)))
"""
    assert fresh("-c", code, folder=tmp_path).strip() == "[]"


def test_a_script_without_its_guard_ends_with_an_error(tmp_path):
    """A script that starts workers without the main guard ends with one line that names it."""
    script = tmp_path / "unguarded.py"
    script.write_text(
        "import gymnasium as gym\n"
        'gym.make_vec("andabata:andabata/Natural-v0", num_envs=2, workers=2)\n'
    )
    done = interpreter(script, folder=tmp_path)
    assert done.returncode == 1
    assert 'under `if __name__ == "__main__":`' in done.stderr.splitlines()[-1]
