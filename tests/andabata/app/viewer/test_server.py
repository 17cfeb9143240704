"""Page of the view: ports, what it says, and how it ends."""

import sys

import pytest

from andabata.app.viewer.server import ViewerError, ViewServer

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


def test_without_viser_the_error_names_the_line_that_installs_it(monkeypatch):
    """Nothing is served."""
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(ViewerError, match=r"pip install -e '\.\[viewer\]'"):
        ViewServer("none", 0)
