"""What is warmed up is compiled for the types that a drive has."""

import pytest

from andabata.assembly import warm_up
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.evaluation.drive import drive_once
from andabata.localization import filter_period
from andabata.machine import ranging
from traversability import scanner

KERNELS = {
    warm_up.warm_up_simulation: ranging.measure_beams,
    warm_up.warm_up_localization: filter_period.run_period,
    warm_up.warm_up_steering: scanner.classify_cells,
}


@pytest.mark.parametrize(("function", "kernel"), KERNELS.items(), ids=lambda each: each.__name__)
def test_a_part_has_all_types_of_a_drive(function, kernel):
    """A drive after it adds no signature to the kernel that the part is about."""
    function()
    before = list(kernel.signatures)
    assert before
    drive_once("hill", 7300, "policy+planner", SimulatedRobotConfig(), time_limit=5.0)
    assert kernel.signatures == before
