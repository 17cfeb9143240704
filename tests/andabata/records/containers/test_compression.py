"""Compressed data come back, and damaged data up to their damage."""

import pytest

from andabata.records.containers import compression
from andabata.records.containers.compression import compress, decompress, decompress_prefix
from traversability import unpacked_size

DATA = bytes(range(256)) * 4000
KINDS = ["bz2", "lz4", "zstd"]


@pytest.mark.parametrize("kind", ["", "none", *KINDS])
def test_data_come_back(kind):
    """Decompression inverts compression."""
    assert decompress(kind, compress(kind, DATA), len(DATA)) == DATA


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("size", [len(DATA) - 1, len(DATA) + 1, 0])
def test_another_size_is_damage(kind, size):
    """Data that do not have the stated size are refused."""
    with pytest.raises(ValueError, match=f"bytes decompressed by {kind}, got"):
        decompress(kind, compress(kind, DATA), size)


@pytest.mark.parametrize("kind", KINDS)
def test_data_that_are_cut_short_are_refused_and_their_prefix_is_kept(kind):
    """A cut is an error for the whole, and the prefix is a prefix of the data."""
    cut = compress(kind, DATA)[:-1]
    with pytest.raises(ValueError, match=r"no end|bytes decompressed"):
        decompress(kind, cut, len(DATA))
    prefix = decompress_prefix(kind, cut)
    assert DATA.startswith(prefix)
    assert decompress_prefix(kind, compress(kind, DATA)) == DATA


def test_sizes_beyond_the_limit_and_unknown_compressions_are_refused(monkeypatch):
    """A size above the limit is refused before decompression; the limit itself is not."""
    monkeypatch.setattr(compression, "LARGEST", len(DATA))
    assert decompress("zstd", compress("zstd", DATA), len(DATA)) == DATA
    monkeypatch.setattr(compression, "LARGEST", len(DATA) - 1)
    with pytest.raises(ValueError, match="expected at most"):
        decompress("zstd", compress("zstd", DATA), len(DATA))
    with pytest.raises(ValueError, match="got 'rar'"):
        decompress("rar", DATA, len(DATA) - 1)


@pytest.mark.parametrize("kind", KINDS)
def test_small_data_that_state_or_hold_far_more_are_refused(kind, monkeypatch):
    """Both the stated size and what is decompressed are bounded by the size of the data."""
    monkeypatch.setattr(unpacked_size, "_SMALL", 1)
    monkeypatch.setattr(unpacked_size, "_MAX_RATIO", 1)
    monkeypatch.setattr(compression, "_PIECE", 4)
    packed = compress(kind, bytes(1 << 20))
    with pytest.raises(ValueError, match=rf"at most {len(packed):,} decompressed bytes of"):
        decompress(kind, packed, 1 << 20)
    twice = compress(kind, packed + bytes(1 << 20))
    size = len(decompress_prefix(kind, twice))
    assert size < (1 << 20 if kind == "lz4" else 2 << 20)
