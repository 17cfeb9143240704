"""Measures the time of each part of the localisation filter, and of filterpy's filter of its size.

``python -m andabata.bench.filter`` prints a Markdown table: the best of seven loops, one core.
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from andabata.bench.table import Row, markdown_table
from andabata.localization import measurement_models
from andabata.localization.filter_parameters import BodyParameters, FilterModel, Gates, NoiseModel
from andabata.localization.filter_state import STATES
from andabata.localization.process_model import predict
from andabata.localization.sigma_points import Workspace
from andabata.localization.ukf import SigmaWeights
from terrain.kernel import borrowing_kernel
from terrain.record import packed

BODY = BodyParameters(0.1, 0.18, 0.09, 0.31, 0.0, 26.0, -34.0)
"""Geometry of a robot and magnetic flux [uT] that the filter is timed with."""

MODEL = FilterModel(BODY, NoiseModel(), Gates(1e9, 1e9, 1e9), SigmaWeights.merwe(STATES), 0.5)
"""Filter that is timed: no measurement is gated."""

STANDING_IMU = np.array([0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 9.81])
"""Row of a standing robot's IMU: stamp [s], yaw rates [rad/s], accelerations [m/s2]."""

_FLUX = np.array([0.0, 0.0, 26.0, -34.0])
_FIX = np.array([0.0, 0.0, 0.0, 0.0, 0.66, 1.4])

PARTS = ("predict", "wheels", "gravity", "compass", "fix")
"""Names of the filter's parts, in the order of ``repeat_part``'s numbers."""

Belief = tuple[NDArray[np.float64], NDArray[np.float64]]


def initial_belief() -> Belief:
    """Return a mean, shape (STATES,), and a covariance, shape (STATES, STATES)."""
    return np.zeros(STATES), np.diag(np.linspace(0.01, 0.1, STATES) ** 2)


@borrowing_kernel
def repeat_part(
    part: int,
    calls: int,
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    imu: NDArray[np.float64],
    flux: NDArray[np.float64],
    fix: NDArray[np.float64],
    models: NDArray[np.void],
    workspaces: NDArray[np.void],
) -> None:
    """Call one part of the filter, by its index in ``PARTS``, many times; see ``run_period``."""
    parameters, workspace = models[0], workspaces[0]
    # The loop is compiled, so that the call from Python does not count.
    for _ in range(calls):
        if part == 0:
            predict(x, P, imu, 0.01, parameters, workspace)
        elif part == 1:
            measurement_models.correct_wheels(x, P, 0.3, parameters, workspace)
        elif part == 2:
            measurement_models.correct_gravity(x, P, imu, parameters, workspace)
        elif part == 3:
            measurement_models.correct_heading(x, P, flux, parameters, workspace)
        else:
            measurement_models.correct_gnss(x, P, fix, parameters, workspace)


@borrowing_kernel
def predict_and_correct(
    steps: int,
    x: NDArray[np.float64],
    P: NDArray[np.float64],
    imu: NDArray[np.float64],
    models: NDArray[np.void],
    workspaces: NDArray[np.void],
) -> None:
    """Predict and correct by gravity, many times; see ``run_period``."""
    parameters, workspace = models[0], workspaces[0]
    for _ in range(steps):
        predict(x, P, imu, 0.01, parameters, workspace)
        measurement_models.correct_gravity(x, P, imu, parameters, workspace)


def best_of_seven(call: Callable[[int], object], calls: int) -> float:
    """Return the duration of one call in the fastest of seven loops [us].

    Args:
        call: Function that does the work as often as its argument says.
        calls: Number of calls in a loop.
    """
    call(2)  # Compiled code is compiled, caches are warm.
    times = []
    for _ in range(7):
        began = time.perf_counter()
        call(calls)
        times.append((time.perf_counter() - began) / calls)
    return 1e6 * min(times)


def time_parts() -> list[Row]:
    """Return the time of each part of the filter [us]."""
    records = (packed(MODEL), packed(Workspace.allocate()))
    rows: list[Row] = []
    for part, name in enumerate(PARTS):
        belief = initial_belief()

        def call(calls: int, part: int = part, belief: Belief = belief) -> None:
            x, P = belief
            repeat_part(part, calls, x, P, STANDING_IMU, _FLUX, _FIX, *records)

        rows.append({"filter": "andabata", "part": name, "time [us]": best_of_seven(call, 2000)})
    return rows


def time_filterpy() -> list[Row]:
    """Return the time of filterpy's prediction and of its correction by three numbers [us]."""
    from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

    points = MerweScaledSigmaPoints(STATES, 1.0, 2.0, 0.0)
    ukf = UnscentedKalmanFilter(
        STATES, 3, 0.01, hx=lambda x: x[:3], fx=lambda x, dt: x, points=points
    )
    ukf.P *= 0.01
    z, noise = np.zeros(3), np.eye(3)
    parts = {
        "predict": lambda n: [ukf.predict() for _ in range(n)],
        "correct": lambda n: [ukf.update(z, R=noise) for _ in range(n)],
    }
    return [
        {"filter": "filterpy", "part": name, "time [us]": best_of_seven(call, 50)}
        for name, call in parts.items()
    ]


def main(argv: Sequence[str] | None = None) -> None:
    """Print the table."""
    argparse.ArgumentParser(description=__doc__).parse_args(argv)
    sys.stdout.write(markdown_table(time_parts() + time_filterpy()))


if __name__ == "__main__":
    main()
