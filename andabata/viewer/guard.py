"""Guard of the live view's server: which pages may connect, and what they may send.

viser serves whoever asks: a page of any site that is open in a browser of this machine could press
the view's controls. The guard stands before viser's server. It takes only pages of the view's own
address (``Host`` against a name that is bound anew, ``Origin`` against foreign pages), wants the
token where the view has one, and passes on only messages that a view's page sends.
"""

import asyncio
import hmac
import logging
import threading
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from http import HTTPStatus
from typing import Annotated, Any, Literal
from urllib.parse import urlsplit

import msgspec
import websockets.asyncio.server as websocket_server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response
from websockets.typing import Data

from andabata.printable import printable

MAX_MESSAGE = 64 * 1024
"""Largest message of a page [bytes]: a camera's takes 300."""

_LOOPBACK = ("127.0.0.1", "localhost", "::1")
"""Names of this machine for itself; behind a tunnel the port may be another one."""

_MAX_REMARKS, _MAX_TEXT = 20, 300
"""Number of different remarks about pages in a view's life, and their longest text."""

_HEADERS = {
    "X-Frame-Options": "DENY",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
}
"""Headers of each answer; ``_content_policy`` is one more."""

_SERVE_LOCK = threading.Lock()

_Number = Annotated[float, msgspec.Meta(ge=-1e9, le=1e9)]
_Vector = tuple[_Number, _Number, _Number]


class _Camera(msgspec.Struct, tag_field="type", tag="ViewerCameraMessage"):
    wxyz: tuple[_Number, _Number, _Number, _Number]
    position: _Vector
    fov: _Number
    near: _Number
    far: _Number
    image_height: _Number
    image_width: _Number
    look_at: _Vector
    up_direction: _Vector


class _Update(msgspec.Struct, forbid_unknown_fields=True):
    value: bool | int | float | str


class _Control(msgspec.Struct, tag_field="type", tag="GuiUpdateMessage"):
    uuid: str
    updates: _Update


class _Command(msgspec.Struct, tag_field="type", tag="CommandTriggerMessage"):
    uuid: str


class _Click(msgspec.Struct, tag_field="type", tag="ScenePointerMessage"):
    event_type: Literal["click"]
    ray_origin: _Vector
    ray_direction: _Vector
    screen_pos: tuple[tuple[_Number, _Number]]


_MESSAGES = msgspec.msgpack.Decoder(_Camera | _Control | _Command | _Click)
"""All that a page of a view sends. viser takes more: a request to publish the view, for one."""


@dataclass(frozen=True)
class Guard:
    """Rules for the pages of one view.

    Attributes:
        token: First part of the path of each request; None if none is wanted.
        report: Function that takes a line for the user.
    """

    token: str | None
    report: Callable[[str], None]

    def refusal(self, request: Request) -> str | None:
        """Return why a request is refused; None if it is not."""
        hosts, origins = (request.headers.get_all(name) for name in ("Host", "Origin"))
        if not _are_ours(hosts):
            return f"expected a page of this machine, got the host {', '.join(hosts) or 'none'}"
        # Programs that are no browser send no origin; a browser's page cannot leave it out.
        if origins and [each.lower() for each in origins] != [f"http://{hosts[0].lower()}"]:
            return f"expected the view's own page, got one of {', '.join(origins)}"
        if self.token is not None and not _equal(_first_part(request.path), self.token):
            return "expected the token of the printed address, got another or none"
        return None

    def answer(
        self,
        inner: Callable[[ServerConnection, Request], Response | None],
        connection: ServerConnection,
        request: Request,
    ) -> Response | None:
        """Return the answer to a request: a refusal, a file, or None to open a socket.

        Args:
            inner: Function of viser that answers.
            connection: Connection of the request.
            request: Request; the token is taken out of its path.
        """
        reason = self.refusal(request)
        if reason is None:
            if self.token is not None:
                request.path = "/" + request.path.lstrip("/")[len(self.token) :].lstrip("/")
            response = inner(connection, request)
        else:
            self.report(f"view: refused a page: {reason}")
            text = f"{reason}; open the address that the command has printed\n"
            response = connection.respond(HTTPStatus.FORBIDDEN, text)
        if response is not None:
            response.headers.update(_HEADERS)
            response.headers["Content-Security-Policy"] = _content_policy(request)
        return response

    def fault(self, message: Data) -> str | None:
        """Return what is wrong with a message of a page; None if nothing is."""
        if isinstance(message, str):
            return "Expected bytes, got text"
        try:
            _MESSAGES.decode(message)
        except (msgspec.MsgspecError, ValueError, RecursionError) as error:
            return str(error)
        return None


class _GuardedConnection(ServerConnection):
    """Connection that drops messages which no page of a view sends."""

    def __init__(self, guard: Guard, *args: Any, **settings: Any) -> None:  # noqa: ANN401
        super().__init__(*args, **settings)
        self._guard = guard

    async def recv(self, decode: bool | None = None) -> Data:  # type: ignore[override]
        """Return the next message that is in order."""
        while (fault := self._guard.fault(message := await super().recv(decode))) is not None:
            self._guard.report(f"view: ignored a message of a page: {fault}")
        return message


class Remarks:
    """Prints each remark once, on one line, and not more than a few."""

    def __init__(self) -> None:
        """Begin without a reader."""
        self.status: Callable[[str], None] = lambda text: None
        self._texts: set[str] = set()
        self._lock = threading.Lock()

    def add(self, text: str) -> None:
        """Print a remark, unless it has been printed, or there were too many.

        Args:
            text: Text, of which strangers may have written a part.
        """
        words = " ".join(printable(text).split())[:_MAX_TEXT]
        line = "".join(each if each.isprintable() else "?" for each in words)
        with self._lock:
            if line in self._texts or len(self._texts) >= _MAX_REMARKS:
                return
            self._texts.add(line)
        self.status(line)


@contextmanager
def guarded_servers(guard: Guard) -> Iterator[None]:
    """Put a guard before the server that viser starts in the block; viser offers no such place.

    Args:
        guard: Rules for its pages.

    Raises:
        RuntimeError: If viser has started none, as a version might that serves in another way.
    """
    serve, guarded = websocket_server.serve, []

    def guarded_serve(
        handler: Callable[[ServerConnection], Awaitable[None]],
        *args: Any,  # noqa: ANN401
        **settings: Any,  # noqa: ANN401
    ) -> Any:  # noqa: ANN401
        guarded.append(True)
        _report_lost_errors(asyncio.get_running_loop(), guard)
        inner = settings.pop("process_request")
        settings |= {
            "max_size": MAX_MESSAGE,
            "logger": _logger(guard),
            "create_connection": lambda *args, **kw: _GuardedConnection(guard, *args, **kw),
            "process_request": lambda *args: guard.answer(inner, *args),
        }
        return serve(handler, *args, **settings)

    with _SERVE_LOCK:
        websocket_server.serve = guarded_serve  # type: ignore[assignment,misc]
        try:
            yield
        finally:
            websocket_server.serve = serve  # type: ignore[misc]
    if not guarded:
        raise RuntimeError("view: expected viser to serve by websockets, got another server")


def _content_policy(request: Request) -> str:
    """Return what a page of the view may do.

    A foreign page that shows the view in a frame could lead clicks onto its buttons. A link with
    ``?websocket=`` or ``?playbackPath=`` would let the page of the view take controls and scripts
    from another server.
    """
    hosts = request.headers.get_all("Host")
    own = f"ws://{hosts[0]}" if _are_ours(hosts) else ""
    return f"frame-ancestors 'none'; connect-src 'self' data: blob: {own}".rstrip()


def _are_ours(hosts: list[str]) -> bool:
    """Return True if the ``Host`` headers of a request are one, of this machine."""
    return len(hosts) == 1 and _host_name(hosts[0]) in _LOOPBACK


def _host_name(host: str) -> str | None:
    """Return the name in a ``Host`` header, without the port; None if there is none."""
    try:
        return urlsplit(f"//{host}").hostname
    except ValueError:
        return None


def _first_part(path: str) -> str:
    """Return the first part of a path."""
    return path.partition("?")[0].lstrip("/").partition("/")[0]


def _equal(one: str, other: str) -> bool:
    """Return True if two texts are equal, in a time that does not depend on where they differ."""
    return hmac.compare_digest(one.encode(), other.encode())


def _report_lost_errors(loop: asyncio.AbstractEventLoop, guard: Guard) -> None:
    """Report errors of the server's tasks on one line; asyncio prints their tracebacks."""

    def report(_: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        text = context["message"] if error is None else f"{type(error).__name__}: {error}"
        guard.report(f"view: a page's message has failed: {text}")

    loop.set_exception_handler(report)


def _logger(guard: Guard) -> logging.Logger:
    """Return the log of one server, whose errors are reported on one line."""

    class Lines(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            error = record.exc_info[1] if record.exc_info else None
            text = record.getMessage()
            guard.report(f"view: {text}: {error}" if error else f"view: {text}")

    logger = logging.Logger("andabata.view", logging.ERROR)
    logger.addHandler(Lines())
    return logger
