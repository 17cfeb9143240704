"""Trains the shipped classifiers: clouds of twelve lasers, then the forest and the ground cells.

``python -m andabata.bench.train_models FOLDER`` takes an hour on two cores and 10 GB of clouds in
FOLDER, where ``forest.npz`` and ``ground_classifier.npz`` are in the end.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from andabata.bench.command import run_command

LASERS = (
    *("vlp-32c", "rs-32", "vlp-16", "hdl-64e", "os1-64", "hdl-32e", "os0-32", "os0-128"),
    *("pandar-40p", "xt-32", "livox-rosette", "utm-30lx"),
)
"""Names of the lasers."""

_SPLIT = ("--set", "clouds_per_world=12")
_THIN = ("--set", "varied_share=1.0", "--set", "assembly.dense_stride=3")
_VARIED = tuple(
    word
    for setting in (
        "varied_share=1.0",
        "lidar_heights=[0.3, 2.0]",
        "lidar_tilts=[0.0, 0.175]",
        "point_shares=[0.1, 1.0]",
        "max_hidden_directions=12",
        "grass=[0.02, 0.15]",
        "litter=[0.0, 0.025]",
        "undulation=[0.005, 0.05]",
        "exact_share=0.08",
        "difficulty=[0.0, 1.0]",
    )
    for word in ("--set", setting)
)
_MEADOWS = (
    "--set",
    'presets=["forest", "hill", "lake", "park", "natural", "hollow", "maze", "meadow", "meadow"]',
)
_PLAIN = (
    "--set",
    'presets=["plain", "meadow"]',
    "--set",
    "max_hazard_distance=20",
    "--set",
    "close_share=0",
)
_ROUGH = {
    "r": (160, "natural-rough", (1200, 96)),
    "s": (170, "meadow-rough", (720, 96)),
}
"""Rough ground: first seed, world, and the numbers of clouds of the paper's laser, to train on and
to validate; three others have 240 and 24."""


def data_sets() -> dict[str, list[str]]:
    """Return the options of each data set by name, in the order in which they are trained on."""
    stony = ("--set", "varied_share=0.6", "--set", 'presets=["stony"]')
    options = {
        "c0": _options(100, 2000, 320, "--set", "varied_share=0.5"),
        "c2": _options(105, 800, 24, *_THIN, "--set", "point_shares=[0.15, 0.6]"),
        "c1": _options(104, 800, 96, *_THIN),
    }
    for k, laser in enumerate(("os1-64", "vlp-16", "livox-rosette")):
        options[f"c{3 + k}"] = _options(
            111 + k, 360, 96, "--sensor", laser, "--set", "varied_share=0.8"
        )
    options["c6"] = _options(114, 1200, 84, *stony)
    for name, (first, world, counts) in _ROUGH.items():
        for k, laser in enumerate(("utm-30lx", "vlp-16", "os1-64", "livox-rosette")):
            options[f"{name}-{laser}"] = _options(
                first + k, *(counts if k == 0 else (240, 24)), *_rough(laser, world)
            )
    for name, first, counts, more in (
        ("d", 120, (360, 48), _MEADOWS),
        ("e", 140, (120, 24), _PLAIN),
    ):
        sets = {
            f"{name}-{laser}": _options(first + k, *counts, "--sensor", laser, *_VARIED, *more)
            for k, laser in enumerate(LASERS)
        }
        options |= dict(sorted(sets.items()))
    return options


def commands(folder: Path) -> list[list[str]]:
    """Return the command lines in their order, without the program's name."""
    sets = data_sets()
    # With rough ground the forest finds more steps and rocks, but fewer low plants.
    of_forest = [name for name in sets if name.partition("-")[0] not in _ROUGH]
    of_ground = [name for name in sets if name != "c2"]
    out = ["--out", str(folder)]
    return [
        *(["clouds", "generate", "--out", str(folder / name), *sets[name]] for name in sets),
        ["classifier", "train", *_together(folder, of_forest), *out],
        ["classifier", "ground", *_together(folder, of_ground), *out],
    ]


def _rough(laser: str, world: str) -> tuple[str, ...]:
    """Return the options of clouds of rough ground."""
    ground = ("--set", f'presets=["{world}"]', "--set", "difficulty=[0.0, 1.0]")
    return ("--sensor", laser, "--set", "varied_share=0.3", *ground)


def _options(seed: int, train: int, validation: int, *more: str) -> list[str]:
    """Return the options of one data set: seed, number of clouds of each split, and others."""
    counts = ["--train", str(train), "--validation", str(validation)]
    return ["--seed", str(seed), *counts, *_SPLIT, *more]


def _together(folder: Path, names: list[str]) -> list[str]:
    """Return the options of some data sets: the first, and those that are added to it."""
    first, *others = (str(folder / name) for name in names)
    return ["--clouds", first, *(word for name in others for word in ("--and", name))]


def main(argv: Sequence[str] | None = None) -> None:
    """Run the commands, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="Folder for the clouds and the classifiers.")
    for words in commands(parser.parse_args(argv).folder):
        sys.stdout.write(run_command(*words))


if __name__ == "__main__":
    main()
