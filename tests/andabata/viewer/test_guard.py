"""The live view's guard: no foreign page connects, and pages send nothing but what pages send."""

import http.client
import math
import socket
import threading

import msgspec
import pytest
import viser
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosedError, InvalidStatus
from websockets.http11 import Request
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from andabata.bench import chromium
from andabata.bench.studies.viewer import CAMERA
from andabata.viewer.guard import MAX_MESSAGE, Guard, Remarks, guarded_servers
from andabata.viewer.server import ViewServer

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")

PATIENCE = 60.0
TOKEN = "s3cret"


@pytest.fixture
def remarks():
    """Lines that the server says."""
    return []


@pytest.fixture
def server(remarks):
    """Server of a view."""
    with ViewServer("guarded", 0) as found:
        found.announce(lambda text: None)
        found._remarks.status = remarks.append
        yield found


def page(server, path="", **settings):
    """Return an open socket of a page."""
    protocol = Subprotocol(f"viser-v{viser.__version__}")
    url = f"ws://127.0.0.1:{server.port}/{path}"
    return connect(url, subprotocols=[protocol], max_size=None, compression=None, **settings)


def read_on(opened):
    """Take in all that a page is sent."""
    while True:
        opened.recv(PATIENCE)


def send(opened, **message):
    """Send a message as a page does."""
    opened.send(msgspec.msgpack.encode(message))


def answer(server, path="/", **headers):
    """Return the answer to a request of a file: its status, headers and text."""
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=PATIENCE)
    connection.request("GET", path, headers={name.title(): text for name, text in headers.items()})
    found = connection.getresponse()
    return found.status, found.headers, found.read().decode()


def request(path="/", **headers):
    """Return a request as the server reads it."""
    return Request(path, Headers({name.title(): text for name, text in headers.items()}))


@pytest.mark.parametrize("host", ["127.0.0.1:80", "localhost", "LOCALHOST:9", "[::1]:8080"])
def test_pages_of_this_machine_are_served(host):
    """A page's own origin is its host's, whatever the port: a tunnel may have another one."""
    guard = Guard(None, print)
    assert guard.refusal(request(host=host)) is None
    assert guard.refusal(request(host=host, origin=f"http://{host}")) is None


@pytest.mark.parametrize(
    ("headers", "reason"),
    [
        ({"host": "evil.example:8080"}, "the host evil.example:8080"),
        ({"host": "127.0.0.1.evil.example"}, "the host 127"),
        ({"host": "evil.example@[::1"}, "the host evil"),
        ({"host": ""}, "the host none"),
        ({}, "the host none"),
        ({"host": "localhost:80", "origin": "http://evil.example"}, "one of http://evil.example"),
        ({"host": "localhost:80", "origin": "http://localhost:81"}, "one of http://localhost:81"),
        ({"host": "localhost:80", "origin": "https://localhost:80"}, "one of https"),
        ({"host": "localhost:80", "origin": "null"}, "one of null"),
    ],
)
def test_foreign_hosts_and_origins_are_refused(headers, reason):
    """Another site, another server of this machine, a name bound anew, and a page of nowhere."""
    refusal = Guard(None, print).refusal(request(**headers))
    assert refusal is not None
    assert reason in refusal


def test_each_of_two_headers_counts():
    """A second host, or a second origin, is refused however good the first one is."""
    for name, good, evil in (
        ("Host", "localhost", "evil.example"),
        ("Origin", "http://localhost", "http://evil.example"),
    ):
        twice = request(host="localhost")
        for text in (good, evil):
            twice.headers[name] = text
        assert Guard(None, print).refusal(twice) is not None


def test_a_foreign_page_moves_no_control(server, remarks):
    """Its socket is refused and the user told once; the view's own page moves the control."""
    box, moved = server.viser.gui.add_checkbox("drive", False), threading.Event()
    box.on_update(lambda event: moved.set())
    for _ in range(2):
        with pytest.raises(InvalidStatus, match="403"), page(server, origin="http://evil.example"):
            pass
    assert remarks == [
        "view: refused a page: expected the view's own page, got one of http://evil.example"
    ]
    with page(server, origin=f"http://127.0.0.1:{server.port}") as opened:
        send(opened, **CAMERA)
        send(opened, type="GuiUpdateMessage", uuid=box._impl.uuid, updates={"value": True})
        assert moved.wait(PATIENCE)


def test_files_are_served_to_this_machine_in_no_frame(server):
    """The page may talk to its own server alone; a foreign host gets a line and no page."""
    status, headers, text = answer(server)
    assert (status, headers["X-Frame-Options"]) == (200, "DENY")
    assert headers["Content-Security-Policy"] == (
        f"frame-ancestors 'none'; connect-src 'self' data: blob: ws://127.0.0.1:{server.port}"
    )
    assert "<html" in text
    status, headers, text = answer(server, host="evil.example")
    assert (status, headers["X-Frame-Options"]) == (403, "DENY")
    assert headers["Content-Security-Policy"].endswith("blob:")
    assert text.endswith("open the address that the command has printed\n")
    assert text.count("\n") == 1


def test_a_view_with_a_token_is_for_those_who_have_it(remarks):
    """Neither page nor socket is served without the token, or with a part of it."""
    with ViewServer("secret", 0, TOKEN) as server:
        assert server.url == f"http://127.0.0.1:{server.port}/{TOKEN}/"
        for path in ("", TOKEN[:-1], f"{TOKEN}x", f"?{TOKEN}", f"x/{TOKEN}"):
            assert answer(server, f"/{path}")[0] == 403
            with pytest.raises(InvalidStatus, match="403"), page(server, path):
                pass
        for path in (f"/{TOKEN}", f"/{TOKEN}/", f"/{TOKEN}/index.html", f"/{TOKEN}/?darkMode"):
            assert answer(server, path)[0] == 200
        with page(server, TOKEN) as opened:
            send(opened, **CAMERA)
            server.wait_for_a_viewer()


def test_an_oversized_message_closes_its_page(server):
    """One byte too many is not taken in; the server goes on."""
    with page(server) as opened:
        opened.send(b"\0" * (MAX_MESSAGE + 1))
        with pytest.raises(ConnectionClosedError) as closed:
            read_on(opened)
    assert closed.value.rcvd.code == 1009
    assert answer(server)[0] == 200


def test_what_no_page_sends_is_ignored(server, remarks, monkeypatch, capfd):
    """Publication, uploads, attributes, numbers that are none, noise: a line each, no traceback."""
    published = []
    monkeypatch.setattr(server.viser, "request_share_url", lambda: published.append(True))
    box, clicks = server.viser.gui.add_checkbox("drive", False), []
    moved = threading.Event()
    box.on_update(lambda event: moved.set())
    server.viser.scene.on_click()(clicks.append)
    click = {"event_type": "click", "ray_origin": (0, 0, 1), "screen_pos": ((0, 0),)}
    with page(server) as opened:
        send(opened, **CAMERA)
        send(opened, type="ShareUrlRequest")
        send(opened, type="GuiUpdateMessage", uuid=box._impl.uuid, updates={"update_cb": 1})
        send(opened, type="ScenePointerMessage", **click, ray_direction=(0, 0, math.nan))
        send(opened, type="ScenePointerMessage", **click, ray_direction=(0, 0, math.inf))
        send(opened, **{**CAMERA, "position": (0, 0)})
        send(opened, type=[[]])
        opened.send(b"\xc1" * 100)
        opened.send(b"\x81\xa1x" + b"\x91" * 50_000)
        opened.send("text")
        send(opened, type="GuiUpdateMessage", uuid=box._impl.uuid, updates={"value": True})
        assert moved.wait(PATIENCE)
    assert (published, clicks) == ([], [])
    assert len(remarks) == 9
    assert all(line.startswith("view: ignored a message of a page: ") for line in remarks)
    assert capfd.readouterr().err == ""


def test_an_error_of_a_handler_is_one_line(server, remarks, capfd):
    """A value that viser cannot convert is no traceback, and the page goes on."""
    slider = server.viser.gui.add_slider("speed", min=0, max=1, step=1, initial_value=0)
    box, moved = server.viser.gui.add_checkbox("drive", False), threading.Event()
    box.on_update(lambda event: moved.set())
    with page(server) as opened:
        send(opened, **CAMERA)
        send(opened, type="GuiUpdateMessage", uuid=slider._impl.uuid, updates={"value": "\nx"})
        send(opened, type="GuiUpdateMessage", uuid=box._impl.uuid, updates={"value": True})
        assert moved.wait(PATIENCE)
    assert [line.split(": ")[:3] for line in remarks] == [
        ["view", "a page's message has failed", "ValueError"]
    ]
    assert capfd.readouterr().err == ""


def test_remarks_are_few_and_short_and_of_printable_letters():
    """A text is told once, twenty texts at most; what would move a terminal's cursor is not."""
    remarks, told = Remarks(), []
    remarks.status = told.append
    for _ in range(2):
        remarks.add("a\x1b[2J\n b" + "c" * 1000)
    assert told == ["a?[2J b" + "c" * 293]
    for number in range(100):
        remarks.add(str(number))
    assert len(told) == 20


def test_a_server_that_is_not_guarded_is_an_error():
    """Another version of viser that serves in another way is noticed."""
    expected = "expected viser to serve by websockets"
    with pytest.raises(RuntimeError, match=expected), guarded_servers(Guard(None, print)):
        pass


@pytest.mark.skipif(chromium.missing() is not None, reason=str(chromium.missing()))
def test_a_browser_connects_to_the_view_and_to_nobody_else():
    """viser's page takes the address of its server from its link, which anyone can write.

    Such a server could send scripts, which would run as the view's own.
    """
    with (
        ViewServer("secret", 0, TOKEN) as server,
        socket.create_server(("127.0.0.1", 0)) as foreign,
        chromium.browser() as browser,
    ):
        page = browser.new_page()
        page.goto(server.url)
        server.wait_for_a_viewer()
        with page.expect_console_message(
            lambda said: "websocket is not connected" in said.text, timeout=1000 * PATIENCE
        ):
            page.goto(f"{server.url}?websocket=ws://127.0.0.1:{foreign.getsockname()[1]}")
        foreign.setblocking(False)
        with pytest.raises(BlockingIOError):
            foreign.accept()
