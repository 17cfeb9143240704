"""Changes inside of archives: one entry changes, the checksums are right."""

import numpy as np

from andabata.bench.studies.soak.archives import with_changed_entry
from traversability.arrays import pack, unpack


def test_one_entry_changes_and_the_archive_stays_whole():
    """The other array and the header are read as before."""
    data = pack({"a": np.zeros(3), "b": np.ones(3)}, {"x": 1})

    def flip_the_end(entry):
        return entry[:-1] + bytes([entry[-1] ^ 1])

    changed, header = unpack(with_changed_entry(data, lambda count: count - 1, flip_the_end), 10**6)
    np.testing.assert_array_equal(changed["a"], np.zeros(3))
    assert (changed["b"] != np.ones(3)).tolist() == [False, False, True]
    assert header == {"x": 1}


def test_what_is_no_archive_stays_as_it_is():
    """And so does one without entries."""
    assert with_changed_entry(b"no archive", lambda count: 0, lambda entry: b"") == b"no archive"
