"""Every command and every code block of the documents runs, or is accounted for by name."""

import json
import os
import re
import secrets
import shlex
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import chdir, suppress
from importlib.util import find_spec
from pathlib import Path
from runpy import run_path

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.bench.movers import BenchMoversConfig
from andabata.bench.studies.ros_graph import Graph, enable_interrupts, stop
from andabata.bench.train_models import commands
from andabata.configuration.settings import SettingsError, resolve
from andabata.datasets.labelled_cloud import CloudsConfig
from andabata.evaluation.barn import BarnEvaluationConfig
from andabata.evaluation.offroad import EvaluationConfig
from andabata.evaluation.rooms import RoomEvaluationConfig
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.records.topics import WHEEL_COMMAND
from andabata.ros.ros2_graph import Ros2Graph
from andabata.training.distillation import DistillationConfig
from andabata.training.imitation import ImitationConfig
from andabata.training.plans import TASKS, algorithms, load_plan
from tests.support.barn_folders import write_world
from tests.support.documents import (
    ROOT,
    Block,
    blocks,
    complaint,
    documents,
    is_ours,
    settings,
    spans,
    verbs,
)
from tests.support.ros2_tools import domain, needs_dds
from tests.support.ros_tools import has_tools
from traversability.cartesian.classifier import GroundClassifierConfig
from traversability.cloud import PointCloud
from traversability.files import cloud_to_bytes, read_cloud
from traversability.forest_training import ForestConfig

BRIEFLY = "".join(
    f" --set stages.{stage}.episodes=2 --set stages.{stage}.environment.terminations.time_limit=5"
    f" --set 'stages.{stage}.environment.seeds=[0]'"
    for stage in ("Maze2D", "Maze3D", "Natural")
)
# Options added to a command, by its first words, so that it takes seconds; of an option given twice
# the last one counts.
REDUCED = {
    "clouds generate": "--train 2 --validation 1 --workers 1 --set patch_size=40",
    "classifier train": "--set trees=8",
    "classifier ground": "--set trees=8",
    "train": "--workers 1 --set validation=0 --set learner.episodes_per_iteration=2" + BRIEFLY,
    "train --task spn": "--workers 1 --set stages.Rooms.steps=400 --set validation=2"
    " --set test_every=0 --set learner.warmup_episodes=2 --set learner.episodes_per_iteration=4"
    " --set stages.Rooms.environment.random_rooms=1",
    "train --task td3": "--workers 1 --set stages.Rooms.steps=400 --set validation=2"
    " --set 'learner.hidden=[16, 16]' --set learner.updates_per_step=0.02"
    " --set learner.episodes_per_iteration=4 --set stages.Rooms.environment.random_rooms=1",
    "report": "--tests 1 --workers 1",
    # A clip needs no cloud, and half a second a frame.
    "drive --world hill --seed 7302 --goal 20,-9 --clip": "--time-limit 1",
    "drive --controller oracle": "--time-limit 5",  # A classifier adapts to some clouds.
    "drive": "--time-limit 4",  # The first cloud takes 3.4 s, and a replay needs one.
    "evaluate --world": "--trials 1 --workers 1 --set terminations.time_limit=3",
    # A failure is drawn only after the first cloud, which takes 3.4 s.
    "evaluate --suite": "--workers 1 --set terminations.time_limit=5",
    "evaluate --task spn": "--pairs 2 --workers 1",
    "evaluate --task barn": "--set count=1 --workers 1",
    "evaluate --task td3": "--pairs 2 --workers 1",
    "faults": "--trials 1 --workers 1 --senses gnss --kinds off --set terminations.time_limit=3",
    "lidar-study": "--pairs 2 --workers 1",
    "bench perception": "--points 2 --tuning 2 --sides 0",
    "bench": "--runs 1 --seconds 0 --only filter",
    "ros robot": "--set plant=kinematic",
    "ros2 robot": "--set plant=kinematic",
}
# Targets of make, which set up a virtual environment of their own: their commands are listed with
# `make -n`, and run elsewhere.
MAKE = {
    "install": "every other target runs it first, and `.ci/run` them",
    "demo": "tests/andabata/app/jobs/test_demonstration.py runs the verb",
    "test": "runs this test",
    "check": "`.ci/run` runs it in a fresh clone",
    "ros": "installs packages of the system; `.ci/run` runs it, and the live graph's tests need it",
    "ros2": "installs rclpy; `.ci/run` runs it, and the live graph's tests with it need it",
    "browser": "installs Chromium; `.ci/run` runs it, and the tests of pages need it",
    "peers": "installs packages; the benchmarks name those that are missing",
    "bench": "takes half an hour; the options of its commands are checked here",
    "docs": "installs packages; tests/test_documents.py builds the site where they are",
    "wheel": "`.ci/run` runs it, and tests/test_distribution.py builds one",
    "newer-python": "`.ci/run` runs it, where there is a newer Python",
    "gallery": "takes ten minutes; tests/andabata/bench/test_gallery.py checks its commands",
    "soak": "takes hours; tests/andabata/bench/studies/soak tests its parts",
}
NEEDS_SHELL = re.compile(r"[|&;<>$`]|--view")
"""Syntax of a shell, and a page whose server ends with its process."""

INSTALLS = {line.removesuffix(" ||") for line in (ROOT / ".ci/wheel.sh").read_text().splitlines()}
"""Lines of the script that installs a wheel as the documents tell; `.ci/run` runs it."""

EXAMPLE = re.compile(r"\.venv/bin/python examples/\w+\.py")
"""Line that runs an example."""

RAY_HEAD = "192.0.2.1:6379"
"""Address of the head of a cluster in the documents."""

ROS_TOOLS = ("roscore", "rostopic", "rosbag", "rosparam")
DOCUMENTS = documents()


def kind(line: str) -> str:
    """Return the program of a line: ours, example, make, install, ros, ros2, ray or unknown."""
    words = line.rstrip("& ").split()
    if words[0].split("/")[-1] == "ray" or "--engine ray" in line:
        return "ray"
    if words[0] == "make" and len(words) == 2 and words[1] in MAKE:
        return "make"
    if line.replace("python3.11", '"$python"') in INSTALLS:
        return "install"
    if EXAMPLE.fullmatch(line):
        return "example"
    if words[0] in ROS_TOOLS or words[1:2] == ["ros"]:
        return "ros"
    if words[1:2] == ["ros2"]:
        return "ros2"
    return "ours" if words[0].split("/")[-1] == "andabata" and is_ours(words) else "unknown"


def graphs(document: str, version: str) -> list[list[str]]:
    """Return the lines of each graph of ``ros`` or ``ros2``, a block each, a terminal a line."""
    found = [
        [line.rstrip("& ") for line in block.commands if kind(line) == version]
        for block in blocks(document)
    ]
    return [lines for lines in found if lines]


def lines_of_a_cluster(document: str) -> list[str]:
    """Return the lines of a Ray cluster, those of its nodes and the commands that run on it."""
    return [line for block in blocks(document) for line in block.commands if kind(line) == "ray"]


@pytest.mark.parametrize("document", DOCUMENTS)
def test_every_line_of_a_block_is_run_by_a_test(document):
    """Every block is Python or a shell's, and every line a command that a test knows."""
    for block in blocks(document):
        assert block.language in ("", "python"), (
            f"{document}: expected shell or python, got {block.language}"
        )
        if block.language == "python":
            continue
        assert block.commands, f"{document}: expected a command in every block"
        for line in block.commands:
            assert kind(line) != "unknown", f"{document}: expected a known command, got {line!r}"
            is_node = kind(line) in ("ros", "ros2")
            assert is_node or not line.endswith("&"), f"{document}: {line!r} goes on"
            assert complaint(line.rstrip("& ")) is None


def test_the_commands_of_the_shipped_classifiers_are_known(tmp_path):
    """The commands that trained the shipped classifiers have known options."""
    for words in commands(tmp_path):
        assert complaint(f"andabata {shlex.join(words)}") is None


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("andabata scan a.ply --sensor-height 1", None),
        ("bag replay", None),
        ("--no-clouds", None),
        ("drive --no-clouds", None),
        ("clouds generate --out X && andabata classifier evaluate --clouds X", None),
        ("make demo", None),
        ("the robot's own", None),
        ("--no-such", "expected a known option, got --no-such"),
        ("drive --no-such", "got --no-such"),
        ("bag replay --sectors=3", "got --sectors"),
        (".venv/bin/andabata bag reply", "expected one of info"),
        ("andabata fly", "got 'fly'"),
        ("clouds generate --out X && andabata classifier judge", "got 'judge'"),
    ],
)
def test_unknown_words_are_found(text, wrong):
    """An unknown verb or option of a text is found; other prose passes."""
    found = complaint(text)
    assert (found is None) if wrong is None else wrong in found


@pytest.mark.parametrize(
    ("line", "who"),
    [
        (".venv/bin/andabata doctor", "ours"),
        (".venv/bin/python examples/drive.py", "example"),
        (".venv/bin/python setup.py", "unknown"),
        (".venv/bin/andabata ros navigator", "ros"),
        (".venv/bin/andabata ros2 navigator", "ros2"),
        ("rostopic hz /cmd_vel", "ros"),
        ("ray start --head", "ray"),
        (".venv/bin/andabata evaluate --engine ray", "ray"),
        ("make test", "make"),
        ("python3.11 -m venv .venv", "install"),
        (".venv/bin/pip install torch", "unknown"),
        ("make tea", "unknown"),
        ("pip install andabata", "unknown"),
        ("curl https://example.org", "unknown"),
        ("andabata fly", "ours"),  # The verb itself is checked elsewhere.
    ],
)
def test_the_program_of_a_line_is_found(line, who):
    """A line of another program is unknown."""
    assert kind(line) == who


def test_comments_and_ends_of_lines_are_those_of_a_shell():
    """Comments are dropped outside quotes, and a backslash joins lines."""
    text = "drive --set 'a=\"#1\"'  # one\n\n# two\nscan a#b.ply \\\n  --level\n"
    assert Block("x.md", "", text).commands == ["drive --set 'a=\"#1\"'", "scan a#b.ply    --level"]


class Sheet:
    """Working folder like a fresh clone, in which the lines of a document run in their order."""

    def __init__(self, folder: Path, as_typed: bool = True) -> None:
        """Set up the folder and the environment.

        Args:
            folder: The folder.
            as_typed: True if each line takes a shell and a process of its own.
        """
        self.as_typed = as_typed
        assert (Path(sys.prefix) / "bin/andabata").exists(), "expected an installed andabata"
        self.folder = folder
        (folder / ".venv").symlink_to(sys.prefix)
        (folder / "examples").symlink_to(ROOT / "examples")
        # This checkout comes first; some documents have `andabata` without a path.
        path = f"{folder / '.venv/bin'}{os.pathsep}{os.environ['PATH']}"
        self.environment = os.environ | {"PYTHONPATH": str(ROOT), "PATH": path}

    def start(self, line: str) -> "subprocess.Popen[str]":
        """Start a line in a shell."""
        return subprocess.Popen(
            ["bash", "-c", line],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            preexec_fn=enable_interrupts,
        )

    def run(self, line: str) -> None:
        """Run a line to its good end; the files of its options exist afterwards.

        Lines of ``andabata`` that need no shell run in this process, which has all imports.
        """
        words = shlex.split(line)
        if self.as_typed or not words[0].endswith("andabata") or NEEDS_SHELL.search(line):
            process = self.start(line)
            out, err = process.communicate()
            assert process.returncode == 0, f"{line}\n{out}\n{err}"
        else:
            with chdir(self.folder):
                assert main(words[1:]) == 0, line
        for path in re.findall(r"--(?:out|record) (\S+)", line):
            assert (self.folder / path).exists(), f"{line}: expected {path}"

    def run_python(self, text: str) -> None:
        """Run a block of Python to its good end; one that starts workers has a process of its own.

        Warnings are errors there as they are here.
        """
        script = self.folder / "block.py"
        script.write_text(text)
        if self.as_typed or "__main__" in text:
            self.run(f".venv/bin/python -W error {script}")
        else:
            with chdir(self.folder):
                run_path(str(script))


def reduced(line: str) -> str:
    """Return a command with the options that make it short."""
    words = line.partition("andabata ")[2]
    found = [start for start in REDUCED if f"{words} ".startswith(f"{start} ")]
    return f"{line} {REDUCED[max(found, key=len)]}" if found else line


def bring_a_cloud(sheet: Sheet, line: str) -> None:
    """Scan a cloud of the data set, in the frame of a sensor at the height that the line gives."""
    cloud = read_cloud(sorted((sheet.folder / "data/clouds").rglob("*.npz"))[0])
    height = float(line.split("--sensor-height ")[1].split()[0])
    points = (cloud.points - np.array([0.0, 0.0, height])).astype(np.float32)
    (sheet.folder / "my_cloud.ply").write_bytes(cloud_to_bytes(PointCloud(points, "sensor"), "ply"))
    sheet.run(line)


def break_off_and_go_on(sheet: Sheet, line: str) -> None:
    """Interrupt an evaluation, copy the first trial to all others in its journal, and go on."""
    journal = sheet.folder / line.split("--out ")[1].split()[0] / "trials.jsonl"
    process = sheet.start(line)
    while process.poll() is None and (not journal.exists() or journal.read_text().count("\n") < 2):
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    _, err = process.communicate()
    assert process.returncode == 130, err
    head, first = journal.read_text().splitlines()[:2]
    rows = json.loads(first)["rows"]
    lines = [head, *(json.dumps({"trial": k, "rows": rows}) for k in range(159))]
    journal.write_text("\n".join(lines) + "\n")
    sheet.run(line)
    assert journal.read_text().count("\n") == 1 + 160
    table = json.loads((journal.parent / "evaluation.json").read_text())["rows"]
    assert {row["world"] for row in table} == {"natural-far", "natural-test"}
    assert len(list((journal.parent / "failures").glob("*.png"))) >= 2


def adapt_briefly(sheet: Sheet, line: str) -> None:
    """Adapt to a drive of seconds: clouds at short intervals, no gap, and any loss of recall."""
    settings = "learned_share = 0.5\ngap = 0.0\nrecall_loss = 1.0\n"
    settings += "[labels]\ninterval = 0.1\n[forest]\ntrees = 3\n"
    (sheet.folder / "brief.toml").write_text(settings)
    sheet.run(f"{line} --adaptation brief.toml")


def bring_worlds(sheet: Sheet, line: str) -> None:
    """Put a world of the benchmark's form where the line expects the benchmark's own."""
    write_world(sheet.folder / line.split("--worlds ")[1].split()[0])
    sheet.run(line)


SPECIAL: dict[str, Callable[[Sheet, str], None]] = {
    "scan my_cloud": bring_a_cloud,
    "evaluate --suite": break_off_and_go_on,
    "evaluate --task barn --worlds": bring_worlds,
    "classifier adapt": adapt_briefly,
}


def type_in(sheet: Sheet, block: Block) -> None:
    """Run a block of Python, or each line of a shell's."""
    if block.language == "python":
        sheet.run_python(block.text)
        return
    for line in block.commands:
        if kind(line) == "example":
            sheet.run(line)
        if kind(line) == "ours":
            words = line.split("andabata ", 1)[1]
            special = [act for start, act in SPECIAL.items() if words.startswith(start)]
            (special[0] if special else Sheet.run)(sheet, reduced(line))


@pytest.mark.parametrize("document", [each for each in DOCUMENTS if blocks(each)])
def test_the_lines_of_a_document_run_in_their_order(document, tmp_path):
    """All lines of a document run to a good end, each after those before it; README's as typed."""
    sheet = Sheet(tmp_path, as_typed=document == "README.md")
    for block in blocks(document):
        type_in(sheet, block)


@pytest.mark.parametrize("target", MAKE)
def test_make_knows_the_targets_and_calls_commands_that_exist(target):
    """The targets of the documents exist, with known commands and existing scripts."""
    command = ["make", "--dry-run", "--directory", str(ROOT), target]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for line in done.stdout.splitlines():
        assert complaint(line) is None
        for module in re.findall(r"bin/python -m (\S+)", line):
            assert find_spec(module) is not None, module
        assert not re.findall(r"bin/python (\S+\.py)", line)


@pytest.mark.parametrize("document", DOCUMENTS)
def test_commands_and_options_in_the_text_exist(document):
    """Commands, options, targets and scripts in running text exist."""
    named = spans((ROOT / document).read_text(encoding="utf-8"))
    assert [wrong for wrong in map(complaint, named) if wrong] == []
    targets = [span.split()[1] for span in named if span.startswith("make ")]
    assert set(targets) <= set(MAKE)
    scripts = [word for span in named if span.startswith("python ") for word in span.split()]
    for word in scripts:
        assert not word.endswith(".py") or (ROOT / word).is_file(), word
    modules = [span.split()[2] for span in named if span.startswith("python -m ")]
    assert [module for module in modules if find_spec(module) is None] == []


@pytest.mark.parametrize("document", DOCUMENTS)
def test_settings_in_the_text_exist(document):
    """Every `--set` in the text names a field of a configuration."""
    bases = [
        SimulatedRobotConfig(),
        EvaluationConfig(),
        BarnEvaluationConfig(),
        BarnEvaluationConfig(vehicle=PLANAR_VEHICLES["barn-skid"]),
        RoomEvaluationConfig(),
        CloudsConfig(),
        ForestConfig(),
        GroundClassifierConfig(),
        DistillationConfig(),
        ImitationConfig(),
        BenchMoversConfig(),
    ]
    bases += [load_plan(name, task=task) for task in TASKS for name in algorithms(task)]
    named = [text for span in spans((ROOT / document).read_text()) for text in settings(span)]
    for text in named:
        assert text == "a.b=c" or any(knows(base, text) for base in bases), text


def knows(base: object, text: str) -> bool:
    """Return True if a configuration has the field of a setting, whatever the value."""
    try:
        resolve(type(base), None, [text], base)
    except SettingsError as error:
        return "known field" not in str(error) and "group of fields" not in str(error)
    return True


@pytest.mark.parametrize(("name", "command"), verbs())
def test_what_the_help_names_exists(name, command):
    """Commands, options and targets in a help text exist."""
    texts = [command.help or "", *(getattr(each, "help", None) or "" for each in command.params)]
    for text in texts:
        assert [wrong for wrong in map(complaint, spans(text)) if wrong] == [], name
        assert {span.split()[1] for span in spans(text) if span.startswith("make ")} <= set(MAKE)


@pytest.mark.skipif(find_spec("ray") is None, reason="no ray: it is an extra, `ray`")
@pytest.mark.parametrize("document", [each for each in DOCUMENTS if lines_of_a_cluster(each)])
def test_the_lines_of_a_cluster_run_on_this_machine(document, tmp_path):
    """Nodes of a document join one cluster, on which its commands run to a good end."""
    sheet, nodes = Sheet(tmp_path), []
    address = f"127.0.0.1:{free_port()}"
    # No other cluster on this machine, and nobody else in this one.
    sheet.environment |= {"RAY_ADDRESS": address, "RAY_AUTH_MODE": "token"}
    sheet.environment["RAY_AUTH_TOKEN"] = secrets.token_hex(32)
    try:
        for line in lines_of_a_cluster(document):
            if "andabata" in line:
                sheet.run(reduced(line))
                continue
            ray = f"{sys.executable} -m ray.scripts.scripts"
            line = re.sub(r"^\S*ray ", f"{ray} ", line).replace(RAY_HEAD, address)
            line = line.replace("--port=6379", f"--port={address.rpartition(':')[2]}")
            nodes.append(sheet.start(f"exec {line} --num-cpus=1 --block"))
            wait_for_an_answer(address)
    finally:
        for node in reversed(nodes):
            os.killpg(node.pid, signal.SIGTERM)
            _, err = node.communicate()
            assert node.returncode is not None, err


def free_port() -> int:
    """Return a port that nobody listens to."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def wait_for_an_answer(address: str) -> None:
    """Return when somebody answers at an address; fail after a minute."""
    host, _, port = address.rpartition(":")
    for _ in range(600):
        with suppress(OSError), socket.create_connection((host, int(port)), timeout=1):
            return
        time.sleep(0.1)
    pytest.fail(f"{address}: expected an answer, got none")


@pytest.mark.skipif(
    not has_tools("roscore"),
    reason="ROS 1's tools are not installed (`make ros`)",
)
@pytest.mark.parametrize("lines", [lines for each in DOCUMENTS for lines in graphs(each, "ros")])
def test_the_lines_of_a_graph_run_side_by_side(lines, tmp_path):
    """The nodes of a block run in one graph, and its topics have rates."""
    graph, sheet = Graph(tmp_path), Sheet(tmp_path)
    graph.environment = sheet.environment | graph.environment | {"PYTHONPATH": str(ROOT)}
    begun = {}
    try:
        for line in lines:
            tool = line.split()[0]
            more = f"{line} -p {graph.port}" if tool == "roscore" else reduced(line)
            words = ["bash", "-c", f"cd {tmp_path} && exec {more}"]
            if tool == "rostopic":
                graph.wait_for(line.split()[-1], "Publishers:")
                rates = graph.tool(*words, seconds=8)
                for topic in line.split()[2:]:
                    assert re.search(rf"^{topic} +\d+\.\d", rates, re.MULTILINE), rates
                continue
            begun[line] = graph.start(*words)
            if tool == "roscore":
                graph.wait_for("/rosout", "Subscribers:")
            elif "ros robot" in line:
                graph.wait_for("/initialpose", "Publishers:")
        for line, process in reversed(begun.items()):
            error = process.output.with_suffix(".err")
            assert process.poll() is None, f"{line}: {error.read_text()}"
            stop(process)
            assert process.returncode in (0, 130), f"{line}: {error.read_text()}"
    finally:
        for process in reversed(graph.processes):
            stop(process)


@needs_dds
@pytest.mark.parametrize("lines", [lines for each in DOCUMENTS for lines in graphs(each, "ros2")])
def test_the_lines_of_a_ros_2_graph_run_side_by_side(lines, tmp_path, monkeypatch):
    """The nodes of a block run in one graph; a robot gets commands, else no start."""
    has_robot = any("ros2 robot" in line for line in lines)
    with domain(monkeypatch):
        graph, sheet, commands = Graph(tmp_path), Sheet(tmp_path), []
        graph.environment = sheet.environment | graph.environment | {"PYTHONPATH": str(ROOT)}
        node = Ros2Graph("watch")
        node.subscribe(WHEEL_COMMAND, lambda _, message: commands.append(message))
        try:
            begun = {
                line: graph.start("bash", "-c", f"cd {tmp_path} && exec {reduced(line)}")
                for line in lines
            }
            errors = [process.output.with_suffix(".err") for process in begun.values()]

            def is_running() -> bool:
                if has_robot:
                    return any(command.left for command in commands)
                return all("no start yet" in each.read_text() for each in errors)

            for _ in range(2400):
                if is_running():
                    break
                time.sleep(0.1)
            assert is_running()
            for (line, process), error in reversed(list(zip(begun.items(), errors, strict=True))):
                assert process.poll() is None, f"{line}: {error.read_text()}"
                stop(process)
                assert process.returncode in (0, 130), f"{line}: {error.read_text()}"
        finally:
            node.close()
            for process in reversed(graph.processes):
                stop(process)
