"""Page of the live view: a viser server on this machine, and its life."""

import getpass
import socket
import threading
from collections.abc import Callable
from types import ModuleType
from typing import TYPE_CHECKING, Self

from andabata.distribution import install_extra

if TYPE_CHECKING:
    import viser

HOST = "127.0.0.1"
"""Address that the page is served on: nobody else on the network sees it."""

DEFAULT_PORT = 8080
"""Port that is tried first."""

_BRAND = (0, 71, 200)
"""Colour of buttons, that of goals in the scene."""


class ViewerError(ValueError):
    """A live view that cannot be shown."""


class ViewServer:
    """Serves the page of one view.

    Attributes:
        viser: Server of the scene and of the controls.
        port: Port of the page.
    """

    def __init__(self, title: str, port: int = DEFAULT_PORT, token: str | None = None) -> None:
        """Begin to serve pages of this machine; those of other sites are refused (``guard``).

        Args:
            title: Title over the controls.
            port: Port that is tried first; 0 takes any that is free.
            token: Secret that is a part of the address; without it nothing is served. None serves
                every program of this machine.

        Raises:
            ViewerError: If viser is not installed.
        """
        module = _import_viser()
        from andabata.viewer.guard import Guard, Remarks, guarded_servers

        self._remarks, self._token = Remarks(), token
        with guarded_servers(Guard(token, self._remarks.add)):
            self.viser: viser.ViserServer = module.ViserServer(
                host=HOST, port=port, label=title, verbose=False
            )
        self.port: int = self.viser.get_port()
        self._wanted = port
        self._viewers_changed = threading.Condition()
        self._is_closed = False
        self.viser.gui.configure_theme(
            control_width="medium",
            show_logo=False,
            show_share_button=False,
            brand_color=_BRAND,
        )

        @self.viser.on_client_connect
        @self.viser.on_client_disconnect
        def _(client: "viser.ClientHandle") -> None:
            with self._viewers_changed:
                self._viewers_changed.notify_all()

    def __enter__(self) -> Self:
        """Return the server."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close the page."""
        self.close()

    @property
    def url(self) -> str:
        """Address of the page, with the token if there is one."""
        address = f"http://{HOST}:{self.port}"
        return address if self._token is None else f"{address}/{self._token}/"

    @property
    def viewers(self) -> int:
        """Number of pages that are open."""
        return len(self.viser.get_clients())

    def announce(self, status: Callable[[str], None]) -> None:
        """Say where the page is, and how to see it from another computer; then who was refused.

        Args:
            status: Function that prints a line for the user, from any thread.
        """
        self._remarks.status = status
        if self._wanted not in (0, self.port):
            status(f"port {self._wanted} is in use; the view takes the next free one")
        status(f"view: {self.url}")
        user, host = getpass.getuser(), socket.gethostname()
        status(f"from another computer: ssh -L {self.port}:{HOST}:{self.port} {user}@{host}")

    def wait_for_a_viewer(self) -> None:
        """Wait until a page is open; Ctrl-C is raised."""
        with self._viewers_changed:
            while not self._is_closed and not self.viewers:
                self._viewers_changed.wait(0.5)

    def wait_for_viewers_to_leave(self) -> None:
        """Wait until no page is open; Ctrl-C ends the wait, too."""
        with self._viewers_changed:
            # A wait without an end would not let Ctrl-C through on every platform.
            while not self._is_closed and self.viewers:
                self._viewers_changed.wait(0.5)

    def close(self) -> None:
        """Close the page; a second call does nothing."""
        if self._is_closed:
            return
        self._is_closed = True
        with self._viewers_changed:
            self._viewers_changed.notify_all()
        self.viser.stop()


def _import_viser() -> ModuleType:
    """Return the package viser, which prints nothing on stdout from now on.

    Raises:
        ViewerError: If it is not installed.
    """
    try:
        import rich
        import viser
    except ImportError as error:
        raise ViewerError(
            "view: expected the package viser, which is not installed; "
            f"`{install_extra('viewer')}` brings it"
        ) from error
    # viser tells on stdout that it has stopped, where a command's result alone belongs.
    rich.reconfigure(quiet=True)
    return viser
