"""Self-test of an installation: small problems with known answers, in seconds.

Each check compares a figure with its limit. Together they touch every compiled or foreign part that
a drive needs: the ray caster, the filter, the classifier, the policy, recordings, and the cache of
machine code, without which every start takes a minute.
"""

import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.app.doctor.import_guard import SIBLINGS, check_origins

_RAY_LIMIT = 1e-3
"""Largest error of a range [m]: ranges are float32."""

_FILTER_LIMIT = 1e-9
"""Largest difference from filterpy's filter, in the units of the states."""

_WALL, _WALL_HALF_WIDTH = 4.0, 2.0
"""Distance of the wall in the made cloud, and half of its width [m]."""

_MESSAGES = 200
"""Number of messages that are written and read again."""


@dataclass(frozen=True)
class Finding:
    """Answer of a check.

    Attributes:
        passed: True if the figure is within its limit.
        figure: Measured and expected values, in words.
        value: The figure, in the unit that the words name; None where there is no number.
        limit: Its limit; None where there is no number.
    """

    passed: bool
    figure: str
    value: float | None = None
    limit: float | None = None


Check = Callable[[], Finding]


def self_test(on_check: Callable[[str], None] = lambda name: None) -> dict[str, Any]:
    """Run all checks and return their answers, ready for JSON; ``ok`` if all passed.

    A check that raises an error has failed: the error is its figure.

    Args:
        on_check: Function called with the name of each check before it runs.
    """
    checks: list[dict[str, Any]] = []
    began = time.perf_counter()
    for name, check in CHECKS.items():
        on_check(name)
        start = time.perf_counter()
        try:
            finding = check()
        except Exception as error:  # Whatever breaks, the other checks go on.
            text = " ".join(str(error).split()) or type(error).__name__
            finding = Finding(False, f"expected an answer, got {type(error).__name__}: {text}")
        seconds = round(time.perf_counter() - start, 3)
        checks.append({"name": name, **asdict(finding), "seconds": seconds})
    return {
        "ok": all(check["passed"] for check in checks),
        "seconds": round(time.perf_counter() - began, 3),
        "checks": checks,
    }


def self_test_text(answers: dict[str, Any]) -> str:
    """Return the answers as text, one check a line."""
    lines = [
        f"{'PASS' if check['passed'] else 'FAIL'}  {check['name']:28} {check['figure']}"
        for check in answers["checks"]
    ]
    failed = sum(not check["passed"] for check in answers["checks"])
    verdict = f"{failed} of {len(lines)} failed" if failed else f"all {len(lines)} passed"
    return "\n".join([*lines, f"{verdict} in {answers['seconds']:.1f} s"])


def check_packages() -> Finding:
    """Check that our packages are ours: other distributions have the same names."""
    folder = Path(check_origins()["andabata"]).parent
    return Finding(True, f"andabata, {', '.join(SIBLINGS)} come from {folder}")


def check_kernel_cache() -> Finding:
    """Check that machine code is kept: without, every start compiles for a minute."""
    from traversability.cartesian.rolling_grid import follow

    stats = getattr(follow, "stats", None)
    if stats is None:
        return Finding(False, "expected compiled code, got none: unset NUMBA_DISABLE_JIT")
    if stats.cache_path is None:
        return Finding(
            False,
            "expected a folder to keep machine code in, got none that can be written; set "
            "NUMBA_CACHE_DIR to one",
        )
    with tempfile.TemporaryFile(dir=stats.cache_path):
        return Finding(True, f"kept in {Path(stats.cache_path).parent}")


def check_rays() -> Finding:
    """Check ranges to a level plane: height over the sine of the angle below the horizon."""
    from terrain.heightfield import Heightfield
    from worlds.rays.scene import RayScene
    from worlds.truth import TruthConfig, build_truth
    from worlds.world import World

    ground = Heightfield(np.zeros((41, 41), dtype=np.float32), 1.0)
    truth = build_truth(ground, (), TruthConfig())
    surface = np.zeros((40, 40), dtype=np.uint8)
    scene = RayScene(World("plane", 0, 0.0, ground, surface, (), (), truth))
    height, count = 0.8, 2000
    bearings = np.linspace(0.0, 20.0 * np.pi, count)
    below = np.linspace(np.deg2rad(3.0), np.deg2rad(90.0), count)
    rays = np.zeros((count, 6), dtype=np.float32)
    rays[:, 2] = height
    rays[:, 3] = np.cos(below) * np.cos(bearings)
    rays[:, 4] = np.cos(below) * np.sin(bearings)
    rays[:, 5] = -np.sin(below)
    ranges, _ = scene.cast(rays, np.full(count, np.inf, dtype=np.float32))
    error = float(np.abs(ranges - height / np.sin(below)).max())
    text = f"{count} rays to a plane, largest error {1e3 * error:.3f} mm (limit 1 mm)"
    return Finding(error < _RAY_LIMIT, text, 1e3 * error, 1e3 * _RAY_LIMIT)


def check_filter() -> Finding:
    """Check compass, wheel and fix corrections against filterpy's unscented filter."""
    from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter
    from scipy.spatial.transform import Rotation

    from andabata.bench.filter import BODY, MODEL, initial_belief
    from andabata.localization import measurement_models as model
    from andabata.localization.filter_state import STATES
    from andabata.localization.sigma_points import Workspace

    flux = np.array([BODY.flux_east, BODY.flux_north, BODY.flux_up])

    def field(x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the magnetic field that a state expects, hard iron included."""
        turn = Rotation.from_euler("ZYX", [x[2], x[1], x[0]])
        return np.asarray(turn.inv().apply(flux) + np.array([x[11], x[12], 0.0]))

    def levelled(field: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a field of the base turned level by roll and pitch, forward and left."""
        return np.asarray(Rotation.from_euler("ZYX", [0.0, x[1], x[0]]).apply(field)[:2])

    def bearing(x: NDArray[np.float64], mean: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the compass bearing that a state expects, linear in the hard iron."""
        a, b = levelled(field(np.array([*x[:11], *mean[11:]])), mean)
        ahead, aside = levelled(field(mean), mean)
        iron = levelled(np.array([*(x[11:13] - mean[11:13]), 0.0]), mean)
        turn = (ahead * iron[1] - aside * iron[0]) / (ahead**2 + aside**2)
        return np.array([np.arctan2(b, a) + turn - x[13]])

    def place(x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the fix that a state expects, its slow error included."""
        return x[6:9] + np.array([x[14], x[15], 0.0])

    x, P = initial_belief()
    workspace, noise = Workspace.allocate(), MODEL.noise
    points = MerweScaledSigmaPoints(STATES, 1.0, 2.0, 0.0)
    reference = UnscentedKalmanFilter(STATES, 3, 0.01, hx=None, fx=None, points=points)
    reference.x, reference.P = x.copy(), P.copy()
    rng, steps = np.random.default_rng(0), 20

    def compare(z: NDArray[np.float64], hx: Callable[..., Any], variances: list[float]) -> None:
        """Let filterpy correct with the same measurement."""
        # filterpy keeps the points from before the last correction: draw them anew.
        reference.sigmas_f = points.sigma_points(reference.x, reference.P)
        reference.update(z, R=np.diag(variances), hx=hx)

    for _ in range(steps):
        mag, mean = field(x) + rng.normal(0, 0.3, 3), x.copy()
        ahead, aside = levelled(mag, mean)
        white = noise.mag**2 / float((levelled(field(mean), mean) ** 2).sum())
        model.correct_heading(x, P, np.array([0.0, *mag]), MODEL, workspace)
        compare(
            np.array([np.arctan2(aside, ahead)]),
            lambda s, mean=mean: bearing(s, mean),
            [white],
        )
        climb = -0.3 * np.sin(x[1])
        model.correct_wheels(x, P, 0.3, MODEL, workspace)
        compare(
            np.array([0.3]),
            lambda s, climb=climb: s[9:10] + 0.3 * s[18:19] + climb * s[19:20],
            [noise.wheel_speed**2],
        )
        fix = place(x) + rng.normal(0, 0.5, 3)
        model.correct_gnss(x, P, np.array([0.0, *fix, 0.7, 1.4]), MODEL, workspace)
        compare(fix, place, [0.49, 0.49, 1.96])
    error = float(max(np.abs(x - reference.x).max(), np.abs(P - reference.P).max()))
    text = f"{3 * steps} corrections, largest difference from filterpy {error:.1e}"
    return Finding(
        error < _FILTER_LIMIT, f"{text} (limit {_FILTER_LIMIT:.0e})", error, _FILTER_LIMIT
    )


def check_scan() -> Finding:
    """Check that a wall ends the ranges ahead, and that level ground behind ends none."""
    from andabata.models import shipped_forest
    from traversability.grid import PolarGrid
    from traversability.scanner import TraversabilityScanner

    grid = PolarGrid()
    scan = TraversabilityScanner(shipped_forest(), grid).scan(wall_cloud())
    ahead = float(scan.ranges[np.abs(grid.bearings) < np.pi / grid.n_sectors * 1.5].min())
    behind = np.abs(grid.bearings) > np.pi / 2
    free = float(np.isposinf(scan.ranges[behind]).mean())
    edges = grid.ring_edges
    ring = int(np.searchsorted(edges, _WALL, side="right")) - 1
    expected = float(edges[ring])
    passed = abs(ahead - expected) < 1e-3 and free == 1.0
    return Finding(
        passed,
        f"a wall at {_WALL:g} m ends the range ahead at {ahead:.2f} m (the ring of it begins at "
        f"{expected:.2f} m); {100 * free:.0f} % free behind (expected 100 %)",
        ahead,
        expected,
    )


def wall_cloud() -> NDArray[np.float32]:
    """Return level ground and a wall ahead in ``base_footprint`` [m], float32, shape (n, 3).

    The ground goes on behind the wall, so that nothing but the wall can end a range.
    """
    rng = np.random.default_rng(0)
    ground = np.column_stack([rng.uniform(-11, 11, (60_000, 2)), rng.normal(0, 0.01, 60_000)])
    side = rng.uniform(-_WALL_HALF_WIDTH, _WALL_HALF_WIDTH, 8000)
    deep, high = rng.uniform(_WALL, _WALL + 0.2, 8000), rng.uniform(0.1, 1.1, 8000)
    wall = np.column_stack([deep, side, high])
    return np.concatenate([ground, wall]).astype(np.float32)


def check_policy() -> Finding:
    """Check that the shipped policy turns to its goal, on either side, the same each time."""
    from andabata.machine.pose import Pose
    from andabata.machine.robot import RobotModel
    from andabata.models import shipped_policy
    from andabata.navigation.controller import ControllerInput
    from andabata.navigation.policy_controller import PolicyController
    from traversability.grid import PolarGrid
    from traversability.virtual_scan import VirtualScan

    robot, grid = RobotModel(), PolarGrid()
    controller = PolicyController(shipped_policy(), robot.speed)
    scan = VirtualScan(np.full(grid.n_sectors, np.inf, dtype=np.float32), grid.outer_radius)
    pose = Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0)

    def steer(heading_error: float) -> float:
        """Return the yaw rate for a goal to one side in the open."""
        goal = 8.0 * np.array([np.cos(heading_error), np.sin(heading_error)])
        situation = ControllerInput(
            0.0, scan, scan, heading_error, 8.0, (0.0, 0.0), pose, pose, goal
        )
        return controller.act(situation).angular

    left, right, again = steer(0.8), steer(-0.8), steer(0.8)
    # A policy learns the mirror image, to a part: signs have to be right, sizes alike.
    passed = bool(left > 0.0 > right and left == again and np.isfinite([left, right]).all())
    return Finding(
        passed,
        f"a goal 0.8 rad to the left: {left:+.2f} rad/s, to the right: {right:+.2f} rad/s",
        left,
    )


def check_recording() -> Finding:
    """Check that messages of both versions of ROS come back from disk as they were."""
    from andabata.records import topics
    from andabata.records.bag_writers import open_writer
    from andabata.records.bags import Bag
    from andabata.records.messages import MessageBuilder

    rows = np.random.default_rng(0).normal(size=(_MESSAGES, 7))
    rows[:, 0] = np.arange(_MESSAGES) / 100
    same = 0
    with tempfile.TemporaryDirectory(prefix="andabata-") as folder:
        for name in ("test.bag", "test.mcap"):
            writer = open_writer(Path(folder) / name)
            builder = MessageBuilder(writer.ros)
            for row in rows:
                writer.write(topics.IMU, builder.stamp_ns(row[0]), builder.imu(row))
            writer.close()
            with Bag(Path(folder) / name) as bag:
                for message, row in zip(bag.messages(), rows, strict=True):
                    rate, force = message.content.angular_velocity, message.content
                    force = force.linear_acceleration
                    got = [rate.x, rate.y, rate.z, force.x, force.y, force.z]
                    is_due = message.stamp_ns == builder.stamp_ns(row[0])
                    same += is_due and got == row[1:].tolist()
    text = f"{same} of {2 * _MESSAGES} messages of a .bag and an .mcap came back as they were"
    return Finding(same == 2 * _MESSAGES, text, same, 2 * _MESSAGES)


CHECKS: dict[str, Check] = {
    "packages are ours": check_packages,
    "machine code is kept": check_kernel_cache,
    "rays to a known plane": check_rays,
    "filter against filterpy": check_filter,
    "cloud to ranges": check_scan,
    "a step of the policy": check_policy,
    "recording written and read": check_recording,
}
"""Checks by name, in the order in which they run."""
