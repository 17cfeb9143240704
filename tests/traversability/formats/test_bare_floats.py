"""Rows of floats without a header: the number of columns follows from the content."""

import numpy as np
import pytest
import torch

from traversability.files import CloudFileError, cloud_to_bytes, decode_cloud_file
from traversability.formats import bare_floats
from traversability.formats.bare_floats import are_zero, no_lengths
from traversability.formats.error import FormatError

RNG = np.random.default_rng(1)


@pytest.fixture(autouse=True)
def _same_draws():
    """Begin each test at the same draws, whichever tests ran before."""
    RNG.bit_generator.state = np.random.default_rng(1).bit_generator.state


def street(count=3000, shuffled=True):
    """Ground and a wall, as x, y, z."""
    r, bearing = RNG.uniform(1, 40, count) ** 1.0, RNG.uniform(-np.pi, np.pi, count)
    points = np.column_stack(
        [r * np.cos(bearing), r * np.sin(bearing), RNG.normal(-1.7, 0.1, count)]
    )
    points[: count // 4, 0] = 6.0
    points[: count // 4, 2] = RNG.uniform(-1.7, 1, count // 4)
    return RNG.permutation(points) if shuffled else points


def tables(n=3000):
    """Return layouts of rows, each a list of columns."""
    xyz, ring, t = street(n), RNG.integers(0, 32, n), np.linspace(0, 0.1, n)
    bright, byte = RNG.random(n), RNG.integers(0, 256, n)
    normals = RNG.normal(size=(n, 3))
    zero = np.zeros(n)
    return [
        [xyz],
        [xyz, bright],
        [xyz, byte],
        [xyz, zero],
        [xyz, byte, ring],
        [xyz, bright, t],
        [xyz, zero, zero],
        [xyz, byte, ring, t],
        [xyz, normals],
        [xyz, byte, normals],
        [xyz, byte, normals, t],
    ]


@pytest.mark.parametrize("kind", ["<f4", "<f8"])
@pytest.mark.parametrize("number", range(11))
def test_the_number_of_columns_is_inferred_from_the_content(number, kind):
    """Eleven layouts, as float32 and as float64."""
    rows = np.column_stack(tables()[number]).astype(np.float32).astype(kind)
    columns, remark = bare_floats.parse(rows.tobytes())
    assert len(columns) == rows.shape[1]
    np.testing.assert_array_equal(columns["y"], rows[:, 1])
    assert (f"{rows.shape[1]} columns" in remark) == (rows.shape[1] != 4)
    assert ("float64" in remark) == (kind == "<f8")


@pytest.mark.parametrize("seed", range(8))
def test_four_columns_are_never_taken_for_others(seed):
    """Whatever else fits the size: 120 points are whole rows of 3, 4, 5, 6 and 8."""
    rng = np.random.default_rng(seed)
    for fourth in (np.zeros(840), rng.random(840), rng.integers(0, 256, 840)):
        rows = np.column_stack([street(840, bool(seed % 2)), fourth]).astype("<f4")
        rows[rng.random(840) < 0.3 * rng.random()] = rng.choice([0.0, np.nan])
        assert len(bare_floats.parse(rows.tobytes())[0]) == 4


def test_slots_without_returns_do_not_hide_the_layout():
    """Every second row is zeros."""
    rows = np.zeros((2000, 4), dtype="<f4")
    rows[1::2] = np.column_stack([street(1000), RNG.random(1000)])
    assert len(bare_floats.parse(rows.tobytes())[0]) == 4


def test_a_ring_is_named():
    """The fifth column of whole numbers below 256 is the ring."""
    assert list(bare_floats.parse(np.column_stack(tables()[4]).astype("<f4").tobytes())[0]) == [
        *("x", "y", "z", "intensity", "ring")
    ]


def test_what_the_content_leaves_open_is_refused_with_the_sizes_that_fit(tmp_path):
    """The error names the option that decides, and the option is checked, too."""
    rows = np.random.default_rng(0).normal(size=(40, 3)).astype("<f4")
    with pytest.raises(FormatError, match="bytes that fit 3, 4, 5, 6, 8; say which with --columns"):
        bare_floats.parse(rows.tobytes())
    (tmp_path / "a.bin").write_bytes(rows.tobytes())
    assert len(decode_cloud_file(tmp_path / "a.bin", columns=3).cloud) == 40
    with pytest.raises(CloudFileError, match="expected a multiple of 28 bytes"):
        decode_cloud_file(tmp_path / "a.bin", columns=7)
    with pytest.raises(CloudFileError, match="--columns: expected at least 3"):
        decode_cloud_file(tmp_path / "a.bin", columns=2)


def test_a_cut_file_is_not_read_by_a_width_that_happens_to_fit(tmp_path):
    """The content still looks like four columns."""
    data = np.column_stack([street(999), RNG.random(999)]).astype("<f4").tobytes()
    cut = data[: len(data) // 20 * 20]
    cut = cut if len(cut) % 16 else cut[:-20]
    with pytest.raises(FormatError, match="multiple of 16 bytes, as the content looks like 4"):
        bare_floats.parse(cut)


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("kind", [">f4", "<i4", "<i2"])
def test_numbers_of_another_type_are_refused(kind, seed):
    """Big-endian floats and integers are no lengths."""
    RNG.bit_generator.state = np.random.default_rng(seed).bit_generator.state
    rows = (np.column_stack(tables()[1]) * (1000 if "i" in kind else 1)).astype(kind)
    with pytest.raises(FormatError, match="float32 or float64"):
        bare_floats.parse(rows.tobytes())


def test_nuscenes_files_have_a_remark_on_their_layout(tmp_path):
    """Five columns are noted, and four written from them need no note."""
    path = tmp_path / "five.pcd.bin"
    path.write_bytes(np.column_stack(tables()[4]).astype("<f4").tobytes())
    decoded = decode_cloud_file(path)
    assert decoded.columns == 5
    assert decoded.remarks == ("5 columns, inferred from its content",)
    again = tmp_path / "four.bin"
    again.write_bytes(cloud_to_bytes(decoded.cloud, "bin", decoded.others))
    four = decode_cloud_file(again)
    assert (four.columns, four.remarks) == (4, ())
    np.testing.assert_array_equal(four.cloud.points, decoded.cloud.points)
    np.testing.assert_array_equal(four.others["intensity"], decoded.others["intensity"])


@pytest.mark.parametrize("flushed", [False, True])
def test_subnormal_numbers_are_no_lengths_even_where_they_count_as_zero(flushed):
    """A process that has loaded a policy takes subnormal numbers for zero; their bits stay."""
    try:
        torch.set_flush_denormal(flushed)
        for kind in ("f4", "f8"):
            words = np.array([0.0, -0.0, 1.5, -700.0, np.inf], dtype=kind)
            words[3:4].view(f"u{words.itemsize}")[0] = 0xE040  # Seven in the other byte order.
            assert no_lengths(words).tolist() == [False, False, False, True, False]
            for swapped in (words, words.byteswap().view(words.dtype.newbyteorder())):
                assert are_zero(swapped).tolist() == [True, True, False, False, False]
    finally:
        torch.set_flush_denormal(False)
