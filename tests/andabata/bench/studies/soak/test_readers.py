"""Readers of the soak: each good file is read, and a file of something else is refused."""

import pytest

from andabata.bench.studies.soak.readers import READERS, name_of_file


@pytest.mark.parametrize("name", READERS)
def test_good_files_are_read_and_others_refused(name, tmp_path):
    """By the named errors of the reader; what is no file of its kind is none of it."""
    reader = READERS[name]
    path = tmp_path / name_of_file(reader)
    for seed in reader.seeds():
        path.write_bytes(seed)
        assert reader.read(path) is not None
    path.write_bytes(b"\x93 something else")
    with pytest.raises(reader.errors()):
        reader.read(path)


def test_the_file_of_a_manifest_has_its_own_name():
    """Others are named by their suffix."""
    assert name_of_file(READERS["manifest"]) == "manifest.json"
    assert name_of_file(READERS["LAZ cloud"]) == "file.laz"
