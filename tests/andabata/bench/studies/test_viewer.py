"""Benchmark of the live view: what it reads from a command and from a page."""

import io

import pytest

from andabata.bench.studies import viewer


class Page:
    """Page that tells a time of the drive, two seconds more each time, and some drawings."""

    def __init__(self, *stamps):
        self._stamps, self._drawings = iter(stamps), iter([100, 160])
        self.frames = None

    def inner_text(self, selector):
        return f"andabata drive\n{next(self._stamps)} s, estimate ok\ngoal at 3.0, 4.0 m"

    def evaluate(self, script):
        return next(self._drawings)

    def wait_for_timeout(self, milliseconds):
        self.frames.extend([0.0] * 40)


def counted(*stamps):
    """Return the figures of a page."""
    page, frames = Page(*stamps), [1.0, 2.0]
    page.frames = frames
    return viewer._counted(page, frames, 1.0)


def test_a_page_is_counted_from_one_look_to_the_next():
    """Frames before do not count; all three figures are of the same span."""
    found = counted(10.0, 14.0)
    span = 40 / found["page_frames_per_s"]
    assert found["page_drawings_per_s"] * span == pytest.approx(60)
    assert found["drive_with_page"] * span == pytest.approx(4.0)


def test_a_drive_that_has_ended_is_no_figure():
    """The error says what to do."""
    with pytest.raises(RuntimeError, match="watch it for less time"):
        counted(10.0, 10.0)


def test_the_address_is_the_one_that_the_command_tells():
    """Other lines pass; without any there is an error."""
    said = "port 8080 is in use\nview: http://127.0.0.1:8081\nmore\n"
    assert viewer._url(io.StringIO(said)) == "http://127.0.0.1:8081"
    with pytest.raises(RuntimeError, match="expected an address"):
        viewer._url(io.StringIO("error: no world\n"))
