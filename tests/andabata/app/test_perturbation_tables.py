"""Tables of disturbances for people."""

from rich.console import Console

from andabata.app.perturbation_tables import offroad_tables
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.evaluation.fault_table import fault_rows
from andabata.evaluation.offroad_table import summarise
from andabata.evaluation.perturbation import arms, perturbation_rows
from andabata.machine.faults import Fault
from tests.support.offroad_attempts import ARMS, PERTURBED, trial

DATA = {
    "rows": summarise(PERTURBED, [arm.name for arm in ARMS]),
    "perturbations": perturbation_rows(PERTURBED, ARMS),
}


def printed(data):
    """Return the tables of an evaluation as a terminal of 80 columns shows them."""
    console = Console(width=80)
    with console.capture() as shown:
        console.print(offroad_tables(data))
    return shown.get()


def test_the_costliest_disturbance_comes_first_in_points():
    """Rows are sorted by their difference; the undisturbed count stands in the title."""
    lines = printed(DATA).splitlines()
    (title,) = (k for k, line in enumerate(lines) if line.startswith("planner, each disturbance"))
    assert "3/4 without any" in lines[title]
    below = [line.split() for line in lines[title:] if "=" in line]
    assert [row[:2] for row in below] == [["soft_iron=0.06", "1/4"], ["latency=0.2", "3/4"]]
    assert below[0][2] == "-50"
    assert below[0][-3:] == ["2", "0", "0.5"]
    assert below[1][2] == "+0"
    assert max(map(len, lines)) <= 80


def test_the_tables_of_worlds_have_the_undisturbed_controllers():
    """What was disturbed stands in the table of disturbances alone."""
    assert "planner@" not in printed(DATA)


def test_faults_have_their_tables_after_those_of_worlds():
    """The tables of worlds have the robot without a fault alone."""
    arms_of_faults = arms(("planner",), SimulatedRobotConfig(), {}, (Fault("imu", "off"),))
    names = [arm.name for arm in arms_of_faults]
    driven = [each for name in names for each in trial(0, name, 3)]
    rows = summarise(driven, names)
    text = printed({"rows": rows, "faults": fault_rows(driven, arms_of_faults)})
    assert "planner@" not in text
    assert text.index("maze") < text.index("planner, each fault alone")
    assert "imu:off" in text


def test_without_disturbances_there_are_the_tables_of_worlds_alone():
    """An evaluation without ``--perturb`` is shown as ever."""
    text = printed({"rows": DATA["rows"][:4]})
    assert "without any" not in text
    assert "reached" in text


def test_controllers_stand_in_pairs_with_the_first():
    """Success in points, SPL and seconds with their intervals, in 80 columns; none is empty."""
    row = {"controller": "random+planner", "against": "policy+planner", "trials": 200}
    row |= {"mcnemar_p": 0.0312, "both": 187}
    for name, value in (("difference", -0.04), ("spl_difference", 0.012)):
        row |= {name: value, f"{name}_low": value - 0.03, f"{name}_high": value + 0.03}
    time = {f"time_difference_s{end}": 104.6 for end in ("", "_low", "_high")}
    none = dict.fromkeys(time)
    text = printed(
        {"rows": DATA["rows"][:4], "differences": [row | time, row | none | {"both": 0}]}
    )
    title, *lines = text[text.index("in pairs with") :].splitlines()
    assert title.rstrip().startswith("in pairs with policy+planner, 200 trials each")
    first, second = (line.split() for line in lines if "random+planner" in line)
    assert " ".join(first) == (
        "random+planner -4 [-7, -1] 0.03 +0.01 [-0.02, +0.04] +105 [+105, +105]"
    )
    assert " ".join(second).startswith("random+planner -4 [-7, -1] 0.03 +0.01 [-0.02, +0.04]")
    assert "105" not in " ".join(second)
    assert max(len(line.rstrip()) for line in text.splitlines()) <= 80
