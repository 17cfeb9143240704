"""What a drive records and draws, from the options of the command."""

from pathlib import Path

import pytest

from andabata.app.options.drive import ClipOptions, RecordOptions
from andabata.configuration.usage import UsageError


def test_a_recording_is_written_where_a_file_is_given():
    """With clouds and map unless they are left out."""
    assert RecordOptions().recording() is None
    found = RecordOptions(Path("a.bag"), clouds=False, local_map=True).recording()
    assert (found.path, found.clouds, found.local_map) == (Path("a.bag"), False, True)
    assert RecordOptions(Path("a.bag")).recording().clouds


def test_a_moving_picture_is_checked_before_the_drive():
    """A format that cannot be written is an error of usage."""
    assert ClipOptions().checked() is None
    for name in ("a.gif", "a.png"):
        assert ClipOptions(Path(name)).checked() == Path(name)
    with pytest.raises(UsageError, match="--clip: expected a file that ends in"):
        ClipOptions(Path("a.jpg")).checked()
