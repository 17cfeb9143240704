"""The shipped policy in another stack: ONNX, with its observation built from plain arrays.

``observation`` and ``steer`` need numpy and onnxruntime alone: copy them. ``main`` checks them
against our own policy. ``andabata policy export --out policy.onnx`` writes the same file.
"""

import numpy as np
import onnxruntime
from numpy.typing import NDArray

SECTORS, MAX_RANGE = 32, 10.0
"""Sectors of the scan, the first one behind, then counter-clockwise, and its largest range [m]."""

DEAD_ZONE, LIMIT = 0.15, 0.5
"""Yaw rate below which the robot drives straight on, and its largest [rad/s]."""


def observation(
    ranges: NDArray[np.float64], last: tuple[float, float], heading_error: float
) -> NDArray[np.float32]:
    """Return the policy's input, float32, shape (1, 35).

    Args:
        ranges: Free distance of each sector [m], shape (32,); infinite is free, NaN is unknown.
        last: The two yaw rates that were driven last, the newest first [rad/s].
        heading_error: Bearing of the goal from straight ahead, to the left positive [rad].
    """
    free = np.where(np.isfinite(ranges), ranges, MAX_RANGE)
    turned = (heading_error + np.pi) % (2 * np.pi) - np.pi
    return np.concatenate([free, last, [turned]]).astype(np.float32)[None]


def steer(session: onnxruntime.InferenceSession, state: NDArray[np.float32]) -> float:
    """Return the yaw rate to drive with the cruising speed of 0.3 m/s [rad/s]."""
    wanted = float(session.run(["action"], {"observation": state})[0][0, 0])
    return 0.0 if abs(wanted) < DEAD_ZONE else max(-LIMIT, min(LIMIT, wanted))


def main() -> None:
    """Export the policy, and drive it and ours through the same situations."""
    from andabata.machine.kinematics import Twist, executed_twist
    from andabata.machine.robot import RobotModel
    from andabata.models import shipped_policy
    from rl.export import policy_to_onnx

    policy, robot, rng = shipped_policy(), RobotModel(), np.random.default_rng(0)
    session = onnxruntime.InferenceSession(policy_to_onnx(policy))
    last, difference = (0.0, 0.0), 0.0
    for _ in range(100):
        ranges = rng.choice([np.inf, np.nan, *rng.uniform(0.5, MAX_RANGE, 6)], SECTORS)
        state = observation(ranges, last, rng.uniform(-np.pi, np.pi))
        ours = executed_twist(Twist(robot.speed, float(policy.act(state[0])[0])), robot).angular
        last = (steer(session, state), last[0])
        difference = max(difference, abs(last[0] - ours))
    print(f"largest difference of 100 yaw rates: {difference:.1e} rad/s")


if __name__ == "__main__":
    main()
