"""Check of a robot's plant before a command drives it, and the remark that it is not bullet."""

from andabata.app.console import Console
from andabata.machine.plants import Plant, check_plant, default_remark


def announce_plant(plant: Plant, console: Console) -> None:
    """Check that a plant can be driven here, and say if it stands in for one that is missing.

    Args:
        plant: Plant of the robot.
        console: Console that shows the remark.

    Raises:
        PlantError: If the package of its engine is not installed.
    """
    check_plant(plant)
    remark = default_remark(plant)
    if remark is not None:
        console.status(f"note: {remark}")
