"""Ground of Gazebo's worlds: planes, heightmaps and models that are named, with known heights."""

import numpy as np
import pytest
from PIL import Image

from tests.support.mesh_files import save
from tests.support.sdf_worlds import CUBE, pose, read, solid
from worlds.sdf.elements import SdfError
from worlds.sdf.meshes import Surface
from worlds.sdf.terrain import terrain_of

X, Y = np.meshgrid([-1.5, 0.0, 0.5], [-1.0, 1.0], indexing="ij")


def image(path, values, kind=np.uint8):
    """Write an image, its first row on top."""
    Image.fromarray(np.array(values, dtype=kind)).save(path)


def heightmap(size="4 4 2", position="0 0 0", name="h.png"):
    """Return a heightmap."""
    return f"<heightmap><uri>{name}</uri><size>{size}</size><pos>{position}</pos></heightmap>"


def terrain(folder, shape, *numbers):
    """Return the ground that a shape is."""
    return terrain_of(read(folder, solid("m", shape, pose(*numbers))).solids[0])


def test_planes_have_their_heights_everywhere(tmp_path):
    """Level, tilted by their normal, tilted by their pose; a ceiling is no ground."""
    level = terrain(tmp_path, "<plane><normal>0 0 1</normal></plane>", 0, 0, 2)
    np.testing.assert_allclose(level.heights(X, Y), np.full((3, 2), 2.0))
    slope = terrain(tmp_path, "<plane><normal>-1 0 2</normal></plane>", 0, 0, 1)
    np.testing.assert_allclose(slope.heights(X, Y), 1 + X / 2)
    turned = terrain(tmp_path, "<plane/>", 0, 1, 0, np.arctan(0.5))
    np.testing.assert_allclose(turned.heights(X, Y), (Y - 1) / 2, atol=1e-12)
    assert level.bounds is slope.bounds is None
    assert terrain(tmp_path, "<plane><normal>0 0 -1</normal></plane>") is None


@pytest.mark.parametrize(("scale", "kind"), [(1, np.uint8), (40, np.uint8), (1000, np.uint16)])
def test_the_first_row_of_an_image_is_in_the_north_and_its_brightest_pixel_on_top(
    tmp_path, scale, kind
):
    """Black is the lowest, the brightest pixel has the full height, whatever its value."""
    image(tmp_path / "h.png", np.array([[0, 0, 2], [0, 0, 0], [4, 0, 0]]) * scale, kind)
    found = terrain(tmp_path, heightmap())
    x, y = np.array([-2.0, 2.0, 2.0, 0.0]), np.array([-2.0, 2.0, -2.0, 0.0])
    np.testing.assert_allclose(found.heights(x, y), [2.0, 1.0, 0.0, 0.0])
    assert found.bounds == (-2.0, -2.0, 2.0, 2.0)
    assert found.spacing == 2.0


def test_between_pixels_heights_are_interpolated(tmp_path):
    """Halfway between two, and in the middle of four."""
    image(tmp_path / "h.png", [[0, 0, 4], [0, 0, 0], [0, 0, 0]])
    found = terrain(tmp_path, heightmap())
    np.testing.assert_allclose(
        found.heights(np.array([1.0, 2.0, 1.0]), np.array([2.0, 1.0, 1.0])), [1.0, 1.0, 0.5]
    )


def test_beyond_its_border_a_heightmap_is_not(tmp_path):
    """On the border it is."""
    image(tmp_path / "h.png", [[1, 1], [1, 1]])
    found = terrain(tmp_path, heightmap())
    x = np.array([2.0, 2.01, 0.0, 0.0])
    y = np.array([-2.0, 0.0, -2.01, 2.0])
    assert np.isfinite(found.heights(x, y)).tolist() == [True, False, False, True]


def test_a_heightmap_is_moved_by_its_position_and_its_pose(tmp_path):
    """Both add up; the extent along x and y may differ."""
    image(tmp_path / "h.png", [[0, 0, 0], [0, 4, 0], [0, 0, 0]])
    found = terrain(tmp_path, heightmap("4 8 2", "1 0 10"), 0, 3, 5)
    assert found.bounds == (-1.0, -1.0, 3.0, 7.0)
    np.testing.assert_allclose(found.heights(np.array([1.0, 1.0]), np.array([3.0, 5.0])), [17, 16])


def test_colours_count_by_their_brightness(tmp_path):
    """White is on top, black below."""
    picture = np.zeros((2, 2, 3), dtype=np.uint8)
    picture[0, 1] = 255
    Image.fromarray(picture).save(tmp_path / "h.png")
    found = terrain(tmp_path, heightmap())
    np.testing.assert_allclose(found.heights(np.array([2.0, -2.0]), np.array([2.0, 2.0])), [2, 0])


def test_a_black_image_is_level(tmp_path):
    """At its position."""
    image(tmp_path / "h.png", np.zeros((3, 3)))
    found = terrain(tmp_path, heightmap(position="0 0 1"))
    np.testing.assert_allclose(found.heights(X, Y), np.ones((3, 2)))


@pytest.mark.parametrize(
    ("numbers", "data", "wrong"),
    [
        ((0, 0, 0, 0, 0, 0.1), None, "expected a heightmap that is not turned"),
        ((0, 0, 0, 0.1), None, "expected a heightmap that is not turned"),
        ((0, 0, 0, 0, 0, np.pi), None, "expected a heightmap that is not turned"),
        ((), b"", "expected an image such as a PNG in .*h.png"),
        ((), b"hello", "expected an image such as a PNG in .*h.png"),
        ((), b"\x89PNG\r\n\x1a\n" + bytes(20), "expected an image such as a PNG"),
    ],
)
def test_what_is_no_heightmap_is_refused(tmp_path, numbers, data, wrong):
    """Turned ones, and files that are no images: file, line and element."""
    image(tmp_path / "h.png", [[0, 1], [1, 2]])
    if data is not None:
        (tmp_path / "h.png").write_bytes(data)
    with pytest.raises(SdfError, match=rf'test\.world:3: <collision name="c">: {wrong}'):
        terrain(tmp_path, heightmap(), *numbers)


def test_elevations_are_refused(tmp_path):
    """Numbers with a point are no grey values: their zero is not black."""
    Image.fromarray(np.ones((3, 3), dtype=np.float32)).save(tmp_path / "h.tiff")
    with pytest.raises(SdfError, match=r"expected whole numbers in .*h\.tiff, got elevations"):
        terrain(tmp_path, heightmap(name="h.tiff"))


@pytest.mark.parametrize("shape", [(1, 1), (1, 5)])
def test_an_image_of_a_line_is_refused(tmp_path, shape):
    """Two pixels a side are the fewest."""
    image(tmp_path / "h.png", np.zeros(shape))
    with pytest.raises(SdfError, match="an image of 2 to 8193 pixels a side, got"):
        terrain(tmp_path, heightmap())


def test_a_mesh_that_is_ground_is_what_is_seen_of_it_from_above(tmp_path):
    """A roof of two slopes; beside it there is nothing."""
    corners = [(-2, -2, 0), (0, -2, 1), (2, -2, 0), (-2, 2, 0), (0, 2, 1), (2, 2, 0)]
    sheet = Surface(
        np.array(corners, dtype=float), np.array([[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]])
    )
    save(tmp_path / "roof.ply", sheet)
    found = terrain(tmp_path, "<mesh><uri>roof.ply</uri></mesh>", 0, 0, 3)
    np.testing.assert_allclose(found.heights(X, Y), 4 - abs(X) / 2, atol=1e-5)
    assert found.bounds == (-2.0, -2.0, 2.0, 2.0)
    assert found.heights(np.array([3.0]), np.array([0.0])) == -np.inf


def test_a_box_may_be_a_ramp(tmp_path):
    """Any shape is ground where it is named as such."""
    found = terrain(tmp_path, CUBE, 0, 0, 0, 0, -np.arctan(0.5), 0)
    top = 0.5 / np.cos(np.arctan(0.5))
    places = np.array([-0.2, 0.0, 0.2])
    np.testing.assert_allclose(found.heights(places, np.zeros(3)), top + places / 2, atol=1e-5)
