"""Peers of ``andabata bench``: tools of others that do the same work on our scenes.

All but open3d, pybullet, filterpy and scikit-learn come with the extras ``peers`` and ``onnx``; a
peer that is not installed raises ImportError when it is made.
"""

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.bench.embree import EmbreeScene
from andabata.bench.perception_peers import quiet
from andabata.localization.filter_state import STATES
from terrain.classes import SemanticClass
from traversability.forest import Forest
from worlds.world import World

Rays = NDArray[np.float32]
"""Rays: origin [m] and unit direction, shape (n, 6)."""

Work = Callable[[], object]
"""Call that is timed; if it returns a float, that is its duration [s]."""

REACH = 30.0
"""Largest range of the rays of peers that have such a limit [m]."""


def embree_rays(world: World, rays: Rays) -> Work:
    """Return raw Embree, as in open3d: first hits on every triangle."""
    scene = EmbreeScene(world)
    return lambda: scene.raw(rays)


def pybullet_rays(world: World, rays: Rays) -> Work:
    """Return pybullet's batches of rays, in its own scene of ground and solids."""
    from worlds.bodies import build_bodies
    from worlds.quiet_pybullet import pybullet

    client = pybullet.connect(pybullet.DIRECT)
    build_bodies(world, client)
    begin = rays[:, :3].astype(float)
    begins, ends = begin.tolist(), (begin + REACH * rays[:, 3:]).tolist()
    most = 4000  # It loses rays of longer batches.
    return lambda: [
        pybullet.rayTestBatch(begins[k : k + most], ends[k : k + most], physicsClientId=client)
        for k in range(0, len(begins), most)
    ]


def mujoco_rays(world: World, rays: Rays) -> Work:
    """Return MuJoCo's ``mj_multiRay``: its heightfield, trunks as cylinders, rocks as ellipsoids.

    It takes rays from one point, so the rays of each sweep start at one point here.
    """
    import mujoco

    ground = world.ground
    low, high = float(ground.heights.min()), float(ground.heights.max())
    model = mujoco.MjModel.from_xml_string(_mujoco_scene(world, low, max(high - low, 1e-3)))
    model.hfield_data[:] = ((ground.heights.T - low) / max(high - low, 1e-3)).ravel()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    origin, directions = rays[0, :3].astype(float), rays[:, 3:].astype(float).ravel()
    hit_geometries, distances = np.zeros(len(rays), dtype=np.int32), np.zeros(len(rays))
    options = {"geomgroup": None, "flg_static": True, "bodyexclude": -1, "normal": None}
    return lambda: mujoco.mj_multiRay(
        model,
        data,
        origin,
        directions,
        geomid=hit_geometries,
        dist=distances,
        nray=len(rays),
        cutoff=REACH,
        **options,
    )


def _mujoco_scene(world: World, low: float, rise: float) -> str:
    """Return ground and solid objects as MuJoCo XML; the heights are filled in later.

    Args:
        world: World to convert.
        low: Lowest height of the ground [m].
        rise: Range of its heights [m].
    """
    ground, geoms = world.ground, []
    nx, ny = ground.heights.shape
    for object_ in world.objects:
        least, most = object_.vertices.min(axis=0), object_.vertices.max(axis=0)
        middle = " ".join(f"{value:.4f}" for value in (least + most) / 2)
        half = (most - least) / 2
        if object_.semantic is SemanticClass.TRUNK:
            size = f"{half[:2].mean():.4f} {half[2]:.4f}"
            geoms.append(f'<geom type="cylinder" pos="{middle}" size="{size}"/>')
        elif object_.semantic is SemanticClass.ROCK:
            size = " ".join(f"{value:.4f}" for value in half)
            geoms.append(f'<geom type="ellipsoid" pos="{middle}" size="{size}"/>')
    size = f"{ground.width / 2} {ground.depth / 2} {rise} 1"
    return (
        f'<mujoco><asset><hfield name="ground" nrow="{ny}" ncol="{nx}" size="{size}"/></asset>'
        f'<worldbody><geom type="hfield" hfield="ground" pos="0 0 {low}"/>{"".join(geoms)}'
        "</worldbody></mujoco>"
    )


def irsim_steps(world: World, beams: int, steps: int) -> Work:
    """Return ir-sim: one robot with a 2D laser between the same walls, without drawing.

    Args:
        world: Maze.
        beams: Number of beams.
        steps: Number of steps of 0.1 s.
    """
    kept = os.environ.get("MPLBACKEND")
    os.environ["MPLBACKEND"] = "Agg"
    try:
        with quiet():
            import irsim
    finally:
        if kept is None:
            del os.environ["MPLBACKEND"]
        else:
            os.environ["MPLBACKEND"] = kept
    shift = world.ground.width / 2 + 2
    walls = []
    for object_ in world.objects:
        low, high = object_.vertices.min(axis=0), object_.vertices.max(axis=0)
        x, y, _ = ((low + high) / 2 + shift).tolist()
        length, width, _ = (high - low).tolist()
        shape = f"{{name: 'rectangle', length: {length:.3f}, width: {width:.3f}}}"
        walls.append(f"  - {{shape: {shape}, state: [{x:.3f}, {y:.3f}, 0]}}\n")
    start = world.tasks[0].start
    text = (
        f"world: {{height: {2 * shift}, width: {2 * shift}, step_time: 0.1, sample_time: 0.1, "
        "collision_mode: 'unobstructed'}\n"
        "robot:\n"
        "  - {kinematics: {name: 'diff'}, shape: {name: 'rectangle', length: 0.9, width: 0.6}, "
        f"state: [{start.x + shift}, {start.y + shift}, {start.yaw}], vel_max: [2, 2], "
        "sensors: [{name: 'lidar2d', range_min: 0, range_max: 10, angle_range: 6.283, "
        f"number: {beams}}}]}}\n"
        "obstacle:\n" + "".join(walls)
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "maze.yaml"
        path.write_text(text, encoding="utf-8")
        with quiet():
            env = irsim.make(str(path), display=False, disable_all_plot=True)
    twist = np.array([[0.3], [0.1]])

    def work() -> None:
        with quiet():
            for _ in range(steps):
                env.step(twist)

    return work


def filterpy_steps(steps: int) -> Work:
    """Return filterpy's filter of the same size: predictions, each with a correction."""
    from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

    points = MerweScaledSigmaPoints(STATES, 1.0, 2.0, 0.0)
    ukf = UnscentedKalmanFilter(
        STATES, 3, 0.01, hx=lambda x: x[:3], fx=lambda x, dt: x, points=points
    )
    ukf.P *= 0.01
    z, noise = np.zeros(3), np.eye(3)

    def work() -> None:
        for _ in range(steps):
            ukf.predict()
            ukf.update(z, R=noise)

    return work


def onnx_forest(forest: Forest, features: NDArray[np.float32]) -> Work:
    """Return onnxruntime with the forest as ``classifier export`` writes it, on one thread."""
    import onnxruntime

    from traversability.export import forest_to_onnx

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(
        forest_to_onnx(forest), options, providers=["CPUExecutionProvider"]
    )
    name = session.get_inputs()[0].name
    return lambda: session.run(None, {name: features})


def sklearn_forest(
    forest: Forest, features: NDArray[np.float32], blocked: NDArray[np.bool_]
) -> Work:
    """Return scikit-learn's boosted trees, as many and as deep, trained on the same cells."""
    from sklearn.ensemble import HistGradientBoostingClassifier

    model = HistGradientBoostingClassifier(
        max_iter=len(forest.trees.roots), max_depth=7, early_stopping=False, random_state=0
    )
    model.fit(features, blocked)
    return lambda: model.predict_proba(features)


def jakteristics_features(points: NDArray[np.float32]) -> Work:
    """Return jakteristics' eigenvalue features of each point within 0.3 m, on one thread."""
    import jakteristics

    cloud = points.astype(np.float64)
    names = ["planarity", "linearity", "sphericity", "verticality", "eigenvalue_sum"]
    return lambda: jakteristics.compute_features(
        cloud, search_radius=0.3, num_threads=1, feature_names=names
    )


def settings_of(peer: str) -> dict[str, Any]:
    """Return the settings with which a peer of ``andabata.bench.perception_peers`` is timed."""
    return {
        "cloth (CSF)": {"resolution": 0.3, "rigidness": 1, "distance": 0.1, "smooth": True},
        "patchwork++": {"distance": 0.08, "uprightness": 0.707, "seeds": 0.125},
    }[peer]
