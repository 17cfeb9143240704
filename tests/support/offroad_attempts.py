"""Attempts off-road with known ends, alone and with disturbances."""

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.evaluation.offroad import attempt_of
from andabata.evaluation.perturbation import arms


def attempt(
    trial,
    goal,
    outcome,
    controller="straight",
    spl=0.5,
    cause="",
    world="maze",
    energy=20.0,
    **changes,
):
    """Return an attempt to reach one of three goals."""
    row = {
        "controller": controller,
        "trial": trial,
        "world": world,
        "world_seed": 1,
        "difficulty": 0.5,
        "goal": goal,
        "goals": 3,
        "outcome": outcome,
        "cause": cause,
        "time_s": 10.0,
        "distance_m": 3.0,
        "spl": spl,
        "trespass_m": 1.0,
        "steering_variation": 0.0,
        "energy_j": 20.0,
        "min_clearance_m": 0.2,
        "end_xy": [0.0, 0.0],
    }
    return attempt_of(row | changes)


def trial(number, name, goals):
    """Return the attempts of a trial that reaches some of its three goals."""
    reached = [attempt(number, goal, "goal", name) for goal in range(1, goals + 1)]
    return [*reached, *([attempt(number, goals + 1, "stuck", name)] if goals < 3 else [])]


ARMS = arms(("planner",), SimulatedRobotConfig(), {"latency": 0.2, "soft_iron": 0.06})
"""A planner alone, then late, then with a bent compass."""

PERTURBED = [
    each
    for number, reached in enumerate([(3, 3, 0), (3, 2, 2), (3, 3, 3), (1, 3, 2)])
    for arm, goals in zip(ARMS, reached, strict=True)
    for each in trial(number, arm.name, goals)
]
"""Attempts of four trials by these arms."""
