"""The soak of a cluster: what it counts."""

import json

from andabata.bench.studies.cluster import Watched, digests
from andabata.datasets.generate import JOURNAL
from andabata.runs import atomic_io


def test_worlds_and_files_that_come_twice_are_counted(tmp_path):
    """A world that stands in the journal twice, and a noted cloud that is written again."""
    watched = Watched(tmp_path)
    watched.look()
    assert (watched.worlds, watched.done_twice, watched.written_twice) == ([], 0, 0)
    for world in range(2):
        atomic_io.write(tmp_path / f"cloud_{world:05d}.npz", b"points")
    lines = ["{}", *(json.dumps({"world": world}) for world in (1, 0)), '{"wor']
    (tmp_path / JOURNAL).write_text("\n".join(lines))
    watched.look()
    assert (watched.worlds, watched.done_twice, watched.written_twice) == ([1, 0], 0, 0)
    keeper = (tmp_path / "cloud_00001.npz").open("rb")  # Else its inode may be given anew.
    atomic_io.write(tmp_path / "cloud_00001.npz", b"points")
    keeper.close()
    (tmp_path / JOURNAL).write_text("\n".join([*lines[:-1], lines[1], ""]))
    watched.look()
    assert (watched.worlds, watched.done_twice, watched.written_twice) == ([1, 0, 1], 1, 1)


def test_digests_are_those_of_all_files_but_some(tmp_path):
    """Files of folders count by their paths; equal bytes have equal digests."""
    (tmp_path / "sub").mkdir()
    for name in ("a", "sub/b", "run.json"):
        (tmp_path / name).write_bytes(b"same")
    found = digests(tmp_path, "run.json")
    assert sorted(found) == ["a", "sub/b"]
    assert len(set(found.values())) == 1
