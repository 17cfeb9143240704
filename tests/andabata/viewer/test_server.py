"""Page of the view: ports, what it says, and how it ends."""

import sys
import threading

import pytest

from andabata.bench.studies.viewer import read_page
from andabata.viewer.server import ViewerError, ViewServer

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")


def test_a_port_in_use_is_said_and_the_next_one_taken(capsys):
    """Both pages are there; the lines name address and tunnel. Nothing goes to stdout."""
    said = []
    with ViewServer("first", 0) as first, ViewServer("second", first.port) as second:
        assert second.port > first.port
        second.announce(said.append)
    assert said[0] == f"port {first.port} is in use; the view takes the next free one"
    assert said[1] == f"view: http://127.0.0.1:{second.port}"
    assert f"ssh -L {second.port}:127.0.0.1:{second.port} " in said[2]
    assert capsys.readouterr().out == ""


def test_without_viewers_nobody_is_waited_for():
    """The wait is over at once, and closing twice does no harm."""
    server = ViewServer("alone", 0)
    server.wait_for_viewers_to_leave()
    server.close()
    server.close()


def test_a_first_page_is_waited_for():
    """The wait ends when a page is open, or the server is closed, and not before."""
    with ViewServer("waits", 0) as server:
        waiting = threading.Thread(target=server.wait_for_a_viewer)
        waiting.start()
        waiting.join(0.6)
        assert waiting.is_alive()
        reader = threading.Thread(target=read_page, args=(server.url,), daemon=True)
        reader.start()
        waiting.join(30)
        assert (waiting.is_alive(), server.viewers) == (False, 1)
    server.wait_for_a_viewer()
    reader.join(30)


def test_without_viser_the_error_names_the_line_that_installs_it(monkeypatch):
    """Nothing is served."""
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(ViewerError, match=r"pip install -e '\.\[viewer\]'"):
        ViewServer("none", 0)
