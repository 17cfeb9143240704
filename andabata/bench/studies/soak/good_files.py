"""Good files of every kind, from which fuzzing and mutants begin."""

from collections.abc import Callable
from pathlib import Path

ABOUT = {"verb": "evaluate", "seed": 1}
"""Description of the run of the journal."""

_SDF = """<sdf version="1.7"><world name="w">
<model name="a" canonical_link="l"><static>1</static><pose degrees="true">1 2 0 0 0 30</pose>
<link name="l"><collision name="c"><geometry><box><size>1 1 1</size></box></geometry></collision>
<collision name="d"><pose relative_to="l">0 1 0 0 0 0</pose><geometry><cylinder><radius>0.1</radius>
<length>1</length></cylinder></geometry></collision></link></model>
<model name="g"><static>true</static><link name="l"><collision name="c"><geometry><plane>
<normal>0 0 1</normal><size>100 100</size></plane></geometry></collision></link></model>
<model name="p"><static>1</static><link name="l"><collision name="c"><geometry><polyline>
<point>0 0</point><point>1 0</point><point>1 1</point><height>1</height></polyline></geometry>
</collision></link></model>
<state world_name="w"><model name="a"><pose>3 2 0 0 0 0</pose></model></state>
</world></sdf>
"""

_COLLADA = """<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="0.1"/><up_axis>Z_UP</up_axis></asset><library_geometries>
<geometry id="g"><mesh><source id="g-p"><float_array id="g-a" count="12">0 0 0 1 0 0 0 1 0 0 0 1
</float_array><technique_common><accessor source="#g-a" count="4" stride="3"/></technique_common>
</source><vertices id="g-v"><input semantic="POSITION" source="#g-p"/></vertices>
<triangles count="2"><input semantic="VERTEX" source="#g-v" offset="0"/><p>0 1 2 0 2 3</p>
</triangles><polylist count="1"><input semantic="VERTEX" source="#g-v" offset="0"/>
<vcount>4</vcount><p>0 1 2 3</p></polylist></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n"><translate>1 2 3</translate>
<rotate>0 0 1 90</rotate><scale>2 2 2</scale><instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>
"""

_VTK = """# vtk DataFile Version 3.0
data
ASCII
DATASET POLYDATA
POINTS 3 float
0 1 2
1.5 2 3e-1
-1 0 1
VERTICES 3 6
1 0
"""

_PLY = """ply
format ascii 1.0
element vertex 2
property float x
property double y
property float z
property uchar red
end_header
0 1 2 7
1.5 2 3e-1 8
"""


def sdf_worlds() -> list[bytes]:
    """Return a world of Gazebo."""
    return [_SDF.encode()]


def collada_meshes() -> list[bytes]:
    """Return a Collada mesh."""
    return [_COLLADA.encode()]


def clouds(kind: str) -> Callable[[], list[bytes]]:
    """Return a function that returns clouds of a kind."""

    def seeds() -> list[bytes]:
        import numpy as np

        from traversability.cloud import PointCloud
        from traversability.files import cloud_to_bytes

        if kind == "vtk":
            return [_VTK.encode()]
        rng = np.random.default_rng(8009)
        points = rng.uniform(-20.0, 20.0, (60, 3)).astype(np.float32)
        stamps, classes = np.sort(rng.uniform(0, 2, 60)), rng.integers(0, 8, 60)
        written = cloud_to_bytes(PointCloud(points, "sensor", stamps, classes=classes), kind)
        return [written, _PLY.encode()] if kind == "ply" else [written]

    return seeds


def shipped(name: str) -> Callable[[], list[bytes]]:
    """Return a function that returns a shipped model."""

    def seeds() -> list[bytes]:
        from importlib.resources import files

        return [files("andabata.models").joinpath(name).read_bytes()]

    return seeds


def forests() -> list[bytes]:
    """Return a small forest."""
    import numpy as np

    from traversability.dataset import CellSamples
    from traversability.features import ALL_FEATURES
    from traversability.forest_training import ForestConfig, train_forest
    from traversability.grid import PolarGrid

    rng, grid = np.random.default_rng(8011), PolarGrid()
    features = rng.normal(size=(600, len(ALL_FEATURES))).astype(np.float32)
    blocked, world = features[:, 0] > 0.5, np.arange(600) // 60
    ring = rng.integers(0, grid.n_rings, 600).astype(np.int32)
    samples = CellSamples(features, blocked, blocked | True, 0, ring, world.astype(np.int32), world)
    config = ForestConfig(trees=2, screen_trees=2)
    return [train_forest(samples, grid, config, seed=1, summary={"cells": 600}).to_bytes()]


def policies() -> list[bytes]:
    """Return a small policy."""
    import numpy as np

    from rl.policies.mlp import MlpPolicy
    from rl.spaces import steering_actions, steering_observations

    observations = steering_observations(2, 10.0, 0.5)
    weights = {
        "layer0.weight": np.zeros((2, observations.size), np.float32),
        "layer0.bias": np.zeros(2, np.float32),
    }
    return [MlpPolicy(weights, observations, steering_actions(0.5)).to_bytes()]


def checkpoints() -> list[bytes]:
    """Return the checkpoint of a small learner."""
    import torch

    from rl.checkpoint import to_bytes

    return [to_bytes({"weight": torch.zeros(2, 2)}, {}, {}, {"stage": 1, "rng": [1, 2]})]


def worlds() -> list[bytes]:
    """Return a small world."""
    from worlds.catalogue import make_world, patch
    from worlds.world_files import world_to_bytes

    return [world_to_bytes(make_world("hill", 1, 0.3, patch("hill", 40.0, 0.5)))]


def rooms() -> list[bytes]:
    """Return a room."""
    from worlds.rooms.files import plan_to_toml
    from worlds.rooms.room import RoomPlan

    plan = RoomPlan(
        about="A", half=(4.0, 4.0), boxes=((0.0, 0.0, 1.0, 1.0),), circles=((2.0, 2.0, 0.3),)
    )
    return [plan_to_toml(plan).encode()]


def paths() -> list[bytes]:
    """Return a path of the BARN benchmark."""
    import io

    import numpy as np

    file = io.BytesIO()
    np.save(file, np.array([[3, 4], [4, 5], [5, 5]]))
    return [file.getvalue()]


def settings() -> list[bytes]:
    """Return settings of the robot."""
    text = 'plant = "kinematic"\n[grid]\nn_sectors = 32\n[filter]\nmax_delay = 2.5\n'
    return [text.encode()]


def class_tables() -> list[bytes]:
    """Return the shipped tables of classes."""
    from importlib.resources import files

    folder = files("traversability").joinpath("class_tables")
    return [entry.read_bytes() for entry in folder.iterdir() if entry.name.endswith(".toml")]


def journals() -> list[bytes]:
    """Return the journal of a run."""
    import tempfile

    from andabata.runs.journal import Journal

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "trials.jsonl"
        journal = Journal(path, ABOUT)
        for trial in range(3):
            journal.append({"trial": trial, "rows": [{"time": 12.5, "outcome": "goal"}]})
        return [path.read_bytes()]


def ledgers() -> list[bytes]:
    """Return a ledger of one entry."""
    from andabata.evaluation.ledger import LedgerEntry

    entry = LedgerEntry(
        table="a",
        split="development",
        seeds="7300 to 7323",
        date="2026-01-01",
        commit="abc",
        command="andabata evaluate",
    )
    return [entry.model_dump_json().encode() + b"\n"]


def manifests() -> list[bytes]:
    """Return the manifest of a data set of one cloud."""
    from traversability.dataset import CloudEntry, Manifest, config_hash

    entry = CloudEntry(
        file="cloud_0.npz", sha256="0" * 64, split="train", world="hill", world_seed=1, points=9
    )
    manifest = Manifest(seed=1, config={}, config_sha256=config_hash({}), clouds=(entry,))
    return [manifest.to_bytes()]


def elevation_models() -> list[bytes]:
    """Return elevation models of a slope: of floats, and of packed whole numbers with voids."""
    import tempfile

    import numpy as np
    import rasterio
    from affine import Affine

    heights = 500.0 + np.add.outer(0.1 * np.arange(50), 0.05 * np.arange(50))
    layouts = (
        {"dtype": "float32"},
        {"dtype": "int16", "nodata": -9999, "compress": "deflate", "tiled": True}
        | {"blockxsize": 16, "blockysize": 16},
    )
    found = []
    for layout in layouts:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "ground.tif"
            place = Affine(1.0, 0.0, 499_975.0, 0.0, -1.0, 5_100_025.0)
            size = {"count": 1, "height": 50, "width": 50, "crs": "EPSG:32632"}
            with rasterio.open(path, "w", "GTiff", transform=place, **size, **layout) as file:
                file.write(heights.astype(layout["dtype"])[None])
            found.append(path.read_bytes())
    return found


def placed_objects() -> list[bytes]:
    """Return a collection of objects on the ground."""
    import json

    objects = (
        {"kind": "tree", "height": "12.5", "radius": 0.3, "crown_radius": None},
        {"kind": "log", "yaw_deg": 90, "length": 5},
        {"kind": "rock"},
    )
    features = [
        {
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": [3.0 * k, -2.5]},
            "properties": properties,
        }
        for k, properties in enumerate(objects)
    ]
    return [json.dumps({"type": "FeatureCollection", "features": features}).encode()]


def recordings(kind: str) -> Callable[[], list[bytes]]:
    """Return a function that returns a recording: ``bag``, ``mcap`` or ``db3``."""

    def seeds() -> list[bytes]:
        import tempfile

        from andabata.bench.studies.soak.recordings import write_recording

        with tempfile.TemporaryDirectory() as folder:
            return [write_recording(Path(folder), kind, 0.2)[1].read_bytes()]

    return seeds
