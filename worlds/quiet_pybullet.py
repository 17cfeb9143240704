"""pybullet, imported without the line about its build that it writes to stderr.

``from worlds.quiet_pybullet import pybullet`` is the import that the packages use.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from tempfile import TemporaryFile


@contextmanager
def without_lines(prefix: bytes) -> Iterator[None]:
    """Drop the lines of stderr that begin with a prefix; all others follow at the end.

    C code writes past ``sys.stderr``, so that the file descriptor itself has to be replaced.

    Args:
        prefix: First bytes of the lines to drop.
    """
    try:
        stderr = os.dup(2)
    except OSError:  # A process without stderr has nothing to drop.
        yield
        return
    with TemporaryFile() as captured:
        os.dup2(captured.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(stderr, 2)
            os.close(stderr)
            captured.seek(0)
            for line in captured:
                if not line.startswith(prefix):
                    os.write(2, line)


with without_lines(b"pybullet build time"):
    import pybullet

__all__ = ["pybullet", "without_lines"]
