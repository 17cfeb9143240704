"""Readers of files from strangers, for mutants and for fuzzing.

Imports stand inside the functions: a process that fuzzes one reader loads no other.
"""

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from andabata.bench.studies.soak import good_files
from andabata.bench.studies.soak.good_files import ABOUT

Errors = tuple[type[Exception], ...]


class Reader(NamedTuple):
    """Reader of a kind of file.

    Attributes:
        group: Group of the readers that are checked together.
        suffix: Suffix of the file's name.
        seeds: Function that returns good files.
        read: Function that reads a path.
        errors: Function that returns the errors that a damaged file may raise, beside OSError.
        traced: Modules and packages whose branches guide the fuzzing.
    """

    group: str
    suffix: str
    seeds: Callable[[], list[bytes]]
    read: Callable[[Path], object]
    errors: Callable[[], Errors]
    traced: tuple[str, ...]


def _read_cloud(path: Path) -> object:
    from traversability.files import read_cloud

    return read_cloud(path)


def _cloud_errors() -> Errors:
    from traversability.files import CloudFileError

    return (CloudFileError,)


def _read_forest(path: Path) -> object:
    from traversability.forest import Forest

    return Forest.load(path)


def _read_ground_classifier(path: Path) -> object:
    from traversability.cartesian.classifier import GroundClassifier

    return GroundClassifier.load(path)


def _forest_errors() -> Errors:
    from traversability.forest import ForestFileError

    return (ForestFileError,)


def _read_policy(path: Path) -> object:
    from rl.policy import load_policy

    return load_policy(path)


def _policy_errors() -> Errors:
    from rl.policy import PolicyFileError

    return (PolicyFileError,)


def _read_checkpoint(path: Path) -> object:
    import torch

    from rl.checkpoint import progress_of, restore

    data = path.read_bytes()
    return progress_of(data), restore(data, {"weight": torch.zeros(2, 2)}, {})


def _checkpoint_errors() -> Errors:
    from rl.checkpoint import CheckpointError

    return (CheckpointError,)


def _read_world(path: Path) -> object:
    from worlds.world_files import load_world

    return load_world(path)


def _world_errors() -> Errors:
    from worlds.world_files import WorldFileError

    return (WorldFileError,)


def _read_sdf(path: Path) -> object:
    from worlds.sdf.world import read_sdf

    return read_sdf(path)


def _read_collada(path: Path) -> object:
    from worlds.sdf.meshes import load_mesh

    return load_mesh(path, str(path))


def _sdf_errors() -> Errors:
    from worlds.sdf.elements import SdfError

    return (SdfError,)


def _read_room(path: Path) -> object:
    from worlds.rooms.files import load_room

    return load_room(path)


def _room_errors() -> Errors:
    from worlds.rooms.files import RoomFileError

    return (RoomFileError,)


def _read_path(path: Path) -> object:
    from worlds.sdf.barn import read_barn_path

    return read_barn_path(path)


def _path_errors() -> Errors:
    from worlds.sdf.barn import BarnFileError

    return (BarnFileError,)


def _read_elevation(path: Path) -> object:
    from worlds.elevation.square import read_square

    return read_square(path, size=40.0)


def _read_objects(path: Path) -> object:
    from worlds.elevation.objects_file import read_objects

    return read_objects(path, None)


def _elevation_errors() -> Errors:
    from worlds.elevation.errors import ElevationError

    return (ElevationError,)


def _read_settings(path: Path) -> object:
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.configuration.settings import resolve

    return resolve(SimulatedRobotConfig, path)


def _settings_errors() -> Errors:
    from andabata.configuration.settings import SettingsError

    return (SettingsError,)


def _read_table(path: Path) -> object:
    from traversability.class_table import load_class_table

    load_class_table.cache_clear()
    return load_class_table(str(path))


def _table_errors() -> Errors:
    from traversability.class_table import ClassTableError

    return (ClassTableError,)


def _read_journal(path: Path) -> object:
    from andabata.runs.journal import Journal

    return Journal(path, ABOUT)


def _value_errors() -> Errors:
    return (ValueError,)


def _read_ledger(path: Path) -> object:
    from andabata.evaluation.ledger import read_ledger

    return read_ledger(path)


def _ledger_errors() -> Errors:
    from andabata.evaluation.ledger import LedgerError

    return (LedgerError,)


def _read_manifest(path: Path) -> object:
    from traversability.dataset import read_manifest

    return read_manifest(path.parent)


def _manifest_errors() -> Errors:
    from traversability.dataset import DatasetError

    return (DatasetError,)


def _read_recording(path: Path) -> object:
    from andabata.records.bags import Bag

    with Bag(path, damaged=True) as bag:
        return [bag.decode(raw) for raw in bag.raw_messages()]


def _recording_errors() -> Errors:
    from andabata.records.bags import BagError

    return (BagError,)


_FORMATS = "traversability.formats"
_ARRAYS = "traversability.arrays"
_CONTAINERS = "andabata.records.containers"


def _cloud(kind: str, *traced: str) -> Reader:
    """Return the reader of a kind of cloud."""
    return Reader(
        "clouds",
        f".{kind}",
        good_files.clouds(kind),
        _read_cloud,
        _cloud_errors,
        ("traversability.files", "traversability.decoding", *traced),
    )


def _recording(kind: str) -> Reader:
    """Return the reader of a kind of recording."""
    return Reader(
        "recordings",
        f".{kind}",
        good_files.recordings(kind),
        _read_recording,
        _recording_errors,
        (_CONTAINERS, "andabata.records.bags", "andabata.records.deserialization"),
    )


READERS = {
    "npz cloud": _cloud("npz", _ARRAYS),
    "PLY cloud": _cloud("ply", _FORMATS),
    "PCD cloud": _cloud("pcd", _FORMATS),
    "VTK cloud": _cloud("vtk", _FORMATS),
    "LAS cloud": _cloud("las", _FORMATS),
    "LAZ cloud": _cloud("laz", _FORMATS),
    "bare floats": _cloud("bin", _FORMATS),
    "forest": Reader(
        "models",
        ".npz",
        good_files.forests,
        _read_forest,
        _forest_errors,
        (_ARRAYS, "traversability.forest", "traversability.trees"),
    ),
    "ground classifier": Reader(
        "models",
        ".npz",
        good_files.shipped("ground_classifier.npz"),
        _read_ground_classifier,
        _forest_errors,
        (_ARRAYS, "traversability.cartesian.classifier", "traversability.trees"),
    ),
    "policy": Reader(
        "models",
        ".safetensors",
        good_files.policies,
        _read_policy,
        _policy_errors,
        ("rl.policy", "rl.spaces"),
    ),
    "checkpoint": Reader(
        "models",
        ".safetensors",
        good_files.checkpoints,
        _read_checkpoint,
        _checkpoint_errors,
        ("rl.checkpoint",),
    ),
    "world": Reader(
        "worlds",
        ".safetensors",
        good_files.worlds,
        _read_world,
        _world_errors,
        ("worlds.world_files",),
    ),
    "SDF world": Reader(
        "worlds", ".world", good_files.sdf_worlds, _read_sdf, _sdf_errors, ("worlds.sdf",)
    ),
    "Collada mesh": Reader(
        "worlds", ".dae", good_files.collada_meshes, _read_collada, _sdf_errors, ("worlds.sdf",)
    ),
    "room": Reader(
        "worlds", ".toml", good_files.rooms, _read_room, _room_errors, ("worlds.rooms.files",)
    ),
    "BARN path": Reader(
        "worlds", ".npy", good_files.paths, _read_path, _path_errors, ("worlds.sdf.barn",)
    ),
    "GeoJSON of objects": Reader(
        "worlds",
        ".geojson",
        good_files.placed_objects,
        _read_objects,
        _elevation_errors,
        ("worlds.elevation.objects_file", "json"),
    ),
    "settings": Reader(
        "settings and journals",
        ".toml",
        good_files.settings,
        _read_settings,
        _settings_errors,
        ("andabata.configuration", "tomllib"),
    ),
    "class table": Reader(
        "settings and journals",
        ".toml",
        good_files.class_tables,
        _read_table,
        _table_errors,
        ("traversability.class_table", "tomllib"),
    ),
    "journal": Reader(
        "settings and journals",
        ".jsonl",
        good_files.journals,
        _read_journal,
        _value_errors,
        ("andabata.runs.journal", "json"),
    ),
    "ledger": Reader(
        "settings and journals",
        ".jsonl",
        good_files.ledgers,
        _read_ledger,
        _ledger_errors,
        ("andabata.evaluation.ledger",),
    ),
    "manifest": Reader(
        "settings and journals",
        "manifest.json",
        good_files.manifests,
        _read_manifest,
        _manifest_errors,
        ("traversability.dataset",),
    ),
    "ROS 1 bag": _recording("bag"),
    "MCAP file": _recording("mcap"),
    "sqlite3 file": _recording("db3"),
}
"""Readers by the names of what they read."""

if find_spec("rasterio") is not None:  # The extra ``gis``.
    READERS["GeoTIFF"] = Reader(
        "worlds",
        ".tif",
        good_files.elevation_models,
        _read_elevation,
        _elevation_errors,
        ("worlds.elevation",),
    )


def name_of_file(reader: Reader) -> str:
    """Return the name of a file that a reader takes."""
    return f"file{reader.suffix}" if reader.suffix.startswith(".") else reader.suffix
