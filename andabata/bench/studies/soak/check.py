"""Runs one check in this process: ``python -m ...soak.check NAME COUNT FOLDER``."""

import sys
from pathlib import Path

from andabata.bench.studies.soak.promises import promise_of
from andabata.bench.studies.soak.runner import write_outcome


def main(name: str, count: str, folder: str) -> None:
    """Run the check of a promise and write its outcome to its folder."""
    files = Path(folder) / "files"
    files.mkdir()
    write_outcome(Path(folder), promise_of(name).run(int(count), files))


if __name__ == "__main__":
    main(*sys.argv[1:])
