"""Code of a user's own: read by file and name, refused with what would do."""

import hashlib

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.configuration.usage import UsageError, words
from andabata.evaluation.barn import BarnComparison, BarnEvaluationConfig
from andabata.evaluation.offroad import EvaluationConfig, OffroadComparison
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.models import Models
from andabata.navigation.planar.catalogue import planar_navigator
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.own_code import OwnCodeError, is_own, load_own, own_digests, own_error

LAW = """
import math

class Ahead:
    def __init__(self, config, rng):
        self.config, self.drawn = config, rng.random()

    def reset(self, *args):
        pass

    def act(self, situation):
        return "ahead"

class Half:
    def act(self, situation):
        return "half"

HALF = 0.5
"""


@pytest.fixture
def law(tmp_path):
    """Return the name of a file with a law."""
    file = tmp_path / "law.py"
    file.write_text(LAW)
    return str(file)


def test_a_class_is_found_by_file_and_name(law):
    """It is the same class each time, and a new one when the file has changed."""
    found = load_own(f"{law}:Ahead", ("reset", "act"))
    assert found(None, np.random.default_rng(0)).act(None) == "ahead"
    assert load_own(f"{law}:Ahead", ()) is found
    with open(law, "a") as file:
        file.write("\n# Another law.\n")
    assert load_own(f"{law}:Ahead", ()) is not found
    assert is_own(f"{law}:Ahead")
    assert not is_own("policy+planner")


@pytest.mark.parametrize(
    ("name", "words_of_it"),
    [
        ("{}:Behind", "expected a class or a function of .*, which has Ahead, Half, got 'Behind'"),
        ("{}:HALF", "which has Ahead, Half, got 'HALF'"),
        ("{}:Half", "expected a class with reset, act, got one without reset; see the guide"),
        ("none.py:Ahead", "expected a Python file none.py, got No such file"),
    ],
)
def test_what_is_not_there_is_refused(law, name, words_of_it):
    """With what the file has."""
    with pytest.raises(OwnCodeError, match=words_of_it):
        load_own(name.format(law), ("reset", "act"))


def test_a_file_that_does_not_run_is_refused(tmp_path):
    """With its own error, and how to see where it comes from."""
    file = tmp_path / "broken.py"
    file.write_text("import math\nmath.nothing\n")
    with pytest.raises(OwnCodeError, match=r"got AttributeError: .*nothing.*; run python .*broken"):
        load_own(f"{file}:Law", ())


def test_an_error_of_own_code_names_its_line(tmp_path):
    """The innermost line of the user's file, also below code of others; other errors are none."""
    file = tmp_path / "law.py"
    file.write_text(
        "def each(values):\n    return sorted(values, key=half)\n\ndef half(x):\n    return x / 0\n"
    )
    with pytest.raises(ZeroDivisionError) as caught:
        load_own(f"{file}:each", ())([1, 2])
    found = own_error(caught.value)
    assert str(found).startswith(f"{file}, line 5: expected code that runs, got ZeroDivisionError:")
    assert own_error(found) is None
    with pytest.raises(KeyError) as caught:
        {}["no"]
    assert own_error(caught.value) is None


def test_a_command_names_the_line_here_and_from_a_worker(tmp_path, capsys):
    """It is no defect of ours."""
    file = tmp_path / "law.py"
    file.write_text("def near(step):\n    return {'near': step.distances}\n")
    words = ["train", "--stages", "1", "--reward", f"{file}:near", "--set", "validation=0"]
    for workers in ("1", "2"):
        assert main([*words, "--workers", workers, "--out", str(tmp_path / workers)]) == 1
        error = capsys.readouterr().err
        assert "law.py, line 2: expected code that runs, got AttributeError: " in error
        assert "defect" not in error


def test_options_take_own_code_where_it_is_wanted(law):
    """Beside the words of the package, whose errors say so."""
    text = f"planner,{law}:Ahead+planner"
    assert words(text, ("planner",), "--controllers", takes_own=True)[1] == f"{law}:Ahead+planner"
    with pytest.raises(UsageError, match="expected some of planner, got"):
        words(text, ("planner",), "--controllers")
    with pytest.raises(UsageError, match=r"expected some of planner or FILE\.py:NAME, got 'pilot'"):
        words("pilot", ("planner",), "--controllers", takes_own=True)


def test_it_steers_alone_and_with_the_planner_around_it(law):
    """It is made with the robot's settings and a source of randomness."""
    config = SimulatedRobotConfig()
    alone = make_steering(f"{law}:Ahead", None, config, rng=np.random.default_rng(1))
    assert alone.controller.act(None) == "ahead"
    assert alone.controller.config is config
    assert alone.controller.drawn == np.random.default_rng(1).random()
    assert not isinstance(alone.planner, LocalPlanner)
    checked = make_steering(f"{law}:Ahead+planner", None, config)
    assert checked.controller.act(None) == "ahead"
    assert isinstance(checked.planner, LocalPlanner)


def test_it_drives_on_flat_ground(law):
    """It is made with the robot and a source of randomness."""
    vehicle = PLANAR_VEHICLES["barn"]
    made = planar_navigator(f"{law}:Ahead", vehicle, np.random.default_rng(1))
    assert made.config is vehicle
    assert made.act(None) == "ahead"


def test_a_journal_tells_one_law_from_another(law):
    """What was in the file stands in the heading: a run with another law does not go on with it."""
    digest = hashlib.sha256(LAW.encode()).hexdigest()
    assert own_digests(["planner", f"{law}:Ahead", f"{law}:Half"]) == {law: digest}
    config = BarnEvaluationConfig(controllers=("straight",), count=1)
    assert "own" not in BarnComparison(config).about
    own = config.model_copy(update={"controllers": (f"{law}:Ahead",)})
    assert BarnComparison(own).about["own"] == {law: digest}
    offroad = EvaluationConfig(controllers=(f"{law}:Ahead+planner",), trials=1)
    assert OffroadComparison.of(offroad, Models()).about["own"] == {law: digest}
