"""``python -m andabata.reference [FOLDER]`` writes the generated pages into a folder."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from andabata.reference import FOLDER, pages
from andabata.runs import atomic_io


def main(argv: Sequence[str] | None = None) -> None:
    """Write the pages into the folder that the words after the program's name give."""
    parser = argparse.ArgumentParser(prog="python -m andabata.reference", description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=FOLDER, help="Folder to write to.")
    folder = parser.parse_args(argv).folder
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in pages().items():
        atomic_io.write(folder / name, text.encode())


if __name__ == "__main__":
    main()
