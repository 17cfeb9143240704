"""How long a prediction and a correction take: ours, compiled, and filterpy's with as many numbers.

Run with ``python tests/benchmarks/bench_filter.py``: the best of seven loops, one core.
"""

import sys
import time
from collections.abc import Callable

import numpy as np
from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter
from numba import njit

from andabata.localization import process_model as model
from andabata.localization.process_model import STATES, Body, Noise, Room, Weights

BODY = Body(0.1, 0.18, 0.09, 0.31, 0.0, 26.0, -34.0)
IMU = np.array([0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 9.81])
FIELD = np.array([0.0, 0.0, 26.0, -34.0])
FIX = np.array([0.0, 0.0, 0.0, 0.0, 0.66, 1.4])


@njit
def repeat(which, calls, x, P, imu, field, fix, body, noise, weights, room):  # type: ignore[no-untyped-def]
    """Call one part of the filter many times."""
    for _ in range(calls):
        if which == 0:
            model.predict(x, P, 0.0, 0.0, 0.1, 0.01, body, noise, weights, room)
        elif which == 1:
            model.see_wheels(x, P, 0.3, noise, 1e9, room)
        elif which == 2:
            model.see_gravity(x, P, imu, body, noise, 1e9, weights, room)
        elif which == 3:
            model.see_field(x, P, field, body, noise, 1e9, weights, room)
        else:
            model.see_fix(x, P, fix, 1e9, room)


def best(look: Callable[[int], object], calls: int) -> float:
    """Return the time of a call in the best of seven loops [us]."""
    look(2)
    times = []
    for _ in range(7):
        began = time.perf_counter()
        look(calls)
        times.append((time.perf_counter() - began) / calls)
    return 1e6 * min(times)


def filterpys() -> tuple[float, float]:
    """Return the time of filterpy's prediction and correction by three numbers [us]."""
    points = MerweScaledSigmaPoints(STATES, 1.0, 2.0, 0.0)
    ukf = UnscentedKalmanFilter(
        STATES, 3, 0.01, hx=lambda x: x[:3], fx=lambda x, dt: x, points=points
    )
    ukf.P *= 0.01
    predicted = best(lambda n: [ukf.predict() for _ in range(n)], 50)
    z = np.zeros(3)
    return predicted, best(lambda n: [ukf.update(z, R=np.eye(3)) for _ in range(n)], 50)


if __name__ == "__main__":
    weights, room = Weights.make(), Room.make()
    for which, name in enumerate(("predict", "wheels", "gravity", "compass", "fix")):
        x, P = np.zeros(STATES), np.diag(np.linspace(0.01, 0.1, STATES) ** 2)
        sent = (x, P, IMU, FIELD, FIX, BODY, Noise(), weights, room)
        took = best(lambda n, w=which, s=sent: repeat(w, n, *s), 2000)  # type: ignore[misc]
        sys.stdout.write(f"{name:8} {took:6.2f} us\n")
    first, second = filterpys()
    sys.stdout.write(f"filterpy {first:6.1f} us to predict, {second:.1f} us to correct\n")
