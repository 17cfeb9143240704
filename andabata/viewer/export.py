"""Recordings of a scene as pages that play by themselves, without a server."""

from pathlib import Path
from typing import TYPE_CHECKING, Self

from andabata.runs import atomic_io

if TYPE_CHECKING:
    import viser

EXPORT_POINTS = 6_000
"""Largest number of laser points of a page."""

EXPORT_PERIOD = 0.5
"""Shortest time between two frames of a page [s]."""


class PageWriter:
    """Writes what is drawn meanwhile as one HTML file; the controls are not in it."""

    def __init__(self, server: "viser.ViserServer", path: Path) -> None:
        """Begin to record.

        Args:
            server: Server of the scene.
            path: File to write.
        """
        self._server, self._path = server, path

    def __enter__(self) -> Self:
        """Record from now on."""
        self._recording = self._server.get_scene_serializer()
        return self

    def hold(self, seconds: float) -> None:
        """Leave the scene as it is for a time [s]."""
        self._recording.insert_sleep(seconds)

    def __exit__(self, kind: type[BaseException] | None, *error: object) -> None:
        """Write the file, unless the drawing has failed."""
        page = self._recording.as_html()
        if kind is None:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            atomic_io.write(self._path, page.encode())
