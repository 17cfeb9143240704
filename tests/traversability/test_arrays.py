"""Arrays in npz files: nothing is lost, any program reads them, and damage is named."""

import io
import re
import tracemalloc

import numpy as np
import pytest

from traversability import unpacked_size
from traversability.arrays import ArrayFileError, pack, unpack

RNG = np.random.default_rng(5)
ARRAYS = {
    "stamps": np.flatnonzero(RNG.random(5000) < 0.7)[:3000] * 1.7e-5,
    "severity": np.where(RNG.random(3000) < 0.5, np.inf, RNG.random(3000)).astype(np.float32),
    "points": RNG.standard_normal((3000, 3)).astype(np.float32),
    "flags": RNG.random(3000) < 0.01,
}


def packed(kinds, **arrays):
    """Return a file whose header claims differences of some types."""
    return pack(arrays, {"differences": kinds})


@pytest.mark.parametrize("differences", [(), ("stamps", "severity")])
def test_arrays_come_back_bit_for_bit(differences):
    """With differences, too; the header comes back as it was given."""
    arrays, header = unpack(pack(ARRAYS, {"frame": "odom"}, differences), 1 << 20)
    assert header == {"frame": "odom"}
    assert arrays.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        assert arrays[name].dtype == array.dtype
        assert arrays[name].tobytes() == array.tobytes()


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("values", [[], [np.nan], [-0.0, 0.0, np.inf, -np.inf, np.nan, 1e-40]])
def test_differences_of_any_bits_are_lossless(kind, values):
    """Infinities, NaN, both zeros, and no number at all."""
    column = np.array(values, dtype=kind)
    arrays, _ = unpack(pack({"a": column}, {}, ["a"]), 1 << 20)
    assert arrays["a"].dtype == kind
    assert arrays["a"].tobytes() == column.tobytes()


def test_differences_take_fewer_bytes():
    """Stamps of those beams that have returns shrink to half of what deflate makes of them."""
    stamps = {"stamps": ARRAYS["stamps"]}
    assert 2 * len(pack(stamps, {}, ["stamps"])) < len(pack(stamps, {}))


def test_numpy_reads_the_files():
    """Differences, too, in one line."""
    with np.load(io.BytesIO(pack(ARRAYS, {}, ["stamps"]))) as file:
        assert (file["points"] == ARRAYS["points"]).all()
        assert (file["flags"] == ARRAYS["flags"]).all()
        planes = file["stamps"]
    stamps = np.ascontiguousarray(planes.T).view("<u8").cumsum(dtype="<u8").view("<f8")
    assert (stamps == ARRAYS["stamps"]).all()


def test_equal_arrays_give_equal_bytes_however_they_lie_in_memory():
    """Columns one after the other, or rows."""
    points = ARRAYS["points"]
    assert pack({"points": points}, {}) == pack({"points": np.asfortranarray(points)}, {})


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (packed({"a": "<f8"}, a=np.zeros((4, 9), np.uint8)), "uint8 (4, 9) for <f8"),
        (packed({"a": "<f4"}, a=np.zeros((4, 9), np.int8)), "int8 (4, 9) for <f4"),
        (packed({"a": "<i4"}, a=np.zeros((4, 9), np.uint8)), "bytes of <f4 or <f8, got"),
        (packed({"b": "<f4"}, a=np.zeros((4, 9), np.uint8)), "types of ['a'], got"),
        (packed(["a"], a=np.zeros((4, 9), np.uint8)), "types of ['a'], got"),
    ],
)
def test_wrong_differences_are_refused(data, message):
    """Another shape or type, a name without an array, no names at all."""
    with pytest.raises(ArrayFileError, match=re.escape(message)):
        unpack(data, 1 << 20)


def test_python_objects_are_refused():
    """They would be pickled."""
    with pytest.raises(ValueError, match="a: expected numbers, got Python objects"):
        pack({"a": np.array([{}])}, {})


def test_no_more_is_unpacked_than_is_declared_and_than_the_size_allows(monkeypatch):
    """An entry that unpacks to more than it says, and one that says too much, are refused."""
    data = bytearray(pack({"a": np.zeros(1 << 20, np.uint8)}, {}))
    with pytest.raises(ArrayFileError, match="expected at most 1000 bytes unpacked, got"):
        unpack(bytes(data), 1000)
    with monkeypatch.context() as patch:
        patch.setattr(unpacked_size, "_SMALL", 2000)
        patch.setattr(unpacked_size, "_MAX_RATIO", 2)
        with pytest.raises(ArrayFileError, match=f"expected at most {2 * len(data)} bytes"):
            unpack(bytes(data), 1 << 30)
    declared = (np.zeros(1 << 20, np.uint8).nbytes + 128).to_bytes(4, "little")
    lying = bytes(data).replace(declared, (300).to_bytes(4, "little"))
    tracemalloc.start()
    with pytest.raises(ArrayFileError, match="expected"):
        unpack(lying, 1 << 30)
    assert tracemalloc.get_traced_memory()[1] < 1 << 18
    tracemalloc.stop()


def test_a_header_that_is_nested_too_deep_is_named():
    """A depth that ends Python's own reader is an error of the file."""
    text = np.frombuffer(b"[" * 100_000 + b"]" * 100_000, np.uint8)
    stream = io.BytesIO()
    np.savez(stream, header=text)
    with pytest.raises(ArrayFileError, match="header: expected JSON"):
        unpack(stream.getvalue(), 1 << 20)
