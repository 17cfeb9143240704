"""Grows the shipped classifiers: clouds of twelve lasers, then the forest and the squares.

Run with ``python tests/benchmarks/grow_models.py FOLDER``: an hour on two cores, 25 GB of clouds in
FOLDER, where ``forest.npz`` and ``ground_classifier.npz`` are in the end.
"""

import sys
from pathlib import Path

from andabata.app.cli import main

LASERS = (
    *("vlp-32c", "rs-32", "vlp-16", "hdl-64e", "os1-64", "hdl-32e", "os0-32", "os0-128"),
    *("pandar-40p", "xt-32", "livox-rosette", "utm-30lx"),
)
SPLIT = ("--set", "clouds_per_world=12")
THIN = ("--set", "varied=1.0", "--set", "assembly.dense_stride=3")
VARIED = tuple(
    word
    for setting in (
        "varied=1.0",
        "heights=[0.3, 2.0]",
        "tilts=[0.0, 0.175]",
        "kept=[0.1, 1.0]",
        "hidden=12",
        "grass=[0.02, 0.15]",
        "litter=[0.0, 0.025]",
        "difficulty=[0.0, 1.0]",
    )
    for word in ("--set", setting)
)
PLAIN = ("--set", 'presets=["plain"]', "--set", "reach=20", "--set", "close=0")


def clouds(seed: int, train: int, validation: int, *options: str) -> list[str]:
    """Return the options of a data set."""
    counts = ["--train", str(train), "--validation", str(validation)]
    return ["--seed", str(seed), *counts, *SPLIT, *options]


def data_sets() -> dict[str, list[str]]:
    """Return the options of each data set by name, in the order in which they are learnt from."""
    stony = ("--set", "varied=0.6", "--set", 'presets=["stony"]')
    found = {
        "c0": clouds(100, 4000, 560, "--set", "varied=0.5"),
        "c2": clouds(105, 1600, 24, *THIN, "--set", "kept=[0.15, 0.6]"),
        "c1": clouds(104, 1600, 84, *THIN),
    }
    for k, laser in enumerate(("os1-64", "vlp-16", "livox-rosette")):
        options = ("--sensor", laser, "--set", "varied=0.8")
        found[f"c{3 + k}"] = clouds(111 + k, 720, 84, *options)
    found["c6"] = clouds(114, 1800, 84, *stony)
    for name, first, counts, more in (
        ("d", 120, (360, 48), ()),
        ("e", 140, (120, 24), PLAIN),
    ):
        sets = {
            f"{name}-{laser}": clouds(first + k, *counts, "--sensor", laser, *VARIED, *more)
            for k, laser in enumerate(LASERS)
        }
        found |= dict(sorted(sets.items()))
    return found


def commands(folder: Path) -> list[list[str]]:
    """Return the command lines, one after the other, without the program's name."""
    sets = data_sets()
    first, *others = (str(folder / name) for name in sets)
    squares = [name for name in others if Path(name).name != "c2"]

    def beside(names: list[str]) -> list[str]:
        return [word for name in names for word in ("--and", name)]

    out = ["--out", str(folder)]
    return [
        *(["clouds", "generate", "--out", str(folder / name), *sets[name]] for name in sets),
        ["classifier", "train", "--clouds", first, *beside(others), *out],
        ["classifier", "ground", "--clouds", first, *beside(squares), *out],
    ]


if __name__ == "__main__":
    for words in commands(Path(sys.argv[1])):
        code = main(words)
        if code:
            sys.exit(code)
