"""Canvas with a depth buffer: discs, lines and triangles, of which the nearest ones show."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.report.rendering.camera import Camera
from terrain.kernel import kernel

_FAR = np.float32(1e9)
"""Depth of a pixel on which nothing is drawn [m]."""


class Canvas(NamedTuple):
    """A picture under way.

    Attributes:
        camera: Camera.
        colours: Red, green and blue of each pixel, 0 to 255, float32, shape (height, width, 3).
        depths: Depth of what each pixel shows along the view [m], float32, shape (height, width).
    """

    camera: Camera
    colours: NDArray[np.float32]
    depths: NDArray[np.float32]

    @classmethod
    def of(
        cls, camera: Camera, colours: NDArray[np.floating], depths: NDArray[np.floating]
    ) -> "Canvas":
        """Return a canvas that shows something in each pixel.

        Args:
            camera: Camera.
            colours: Colour of each pixel, row by row, shape (height * width, 3).
            depths: Depth of each pixel, infinite for the sky [m], shape (height * width,).
        """
        shape = (camera.height, camera.width)
        near = np.minimum(depths, _FAR).astype(np.float32)
        return cls(camera, colours.astype(np.float32).reshape(*shape, 3), near.reshape(shape))

    def discs(
        self,
        places: NDArray[np.floating],
        radii: NDArray[np.float64] | float,
        colours: NDArray[np.floating],
        lift: float = 0.0,
    ) -> None:
        """Draw discs that face the camera.

        Args:
            places: Centres in the map [m], shape (n, 3).
            radii: Radii [m], shape (n,), or one for all.
            colours: Colours, shape (n, 3), or one for all, shape (3,).
            lift: Distance by which they lie nearer than they are [m].
        """
        projected = self.camera.project(places)
        radii = self.camera.pixels(radii, projected[:, 2])
        projected[:, 2] -= lift
        draw_discs(self.colours, self.depths, projected, radii, _for_each(colours, len(places)))

    def lines(
        self,
        begins: NDArray[np.floating],
        ends: NDArray[np.floating],
        radii: tuple[float, float],
        colours: NDArray[np.floating],
        lift: float = 0.0,
    ) -> None:
        """Draw straight lines.

        Args:
            begins: Places where they begin in the map [m], shape (n, 3).
            ends: Places where they end, shape (n, 3).
            radii: Half of their width where they begin and where they end [m].
            colours: Colours, shape (n, 3), or one for all, shape (3,).
            lift: Distance by which they lie nearer than they are [m].
        """
        a, b = self.camera.project(begins), self.camera.project(ends)
        widths = np.column_stack(
            [self.camera.pixels(r, p[:, 2]) for r, p in zip(radii, (a, b), strict=True)]
        )
        a[:, 2] -= lift
        b[:, 2] -= lift
        draw_lines(self.colours, self.depths, a, b, widths, _for_each(colours, len(begins)))

    def strip(
        self,
        places: NDArray[np.floating],
        radius: float,
        colour: NDArray[np.floating],
        lift: float = 0.0,
    ) -> None:
        """Draw a line through places in a row, shape (n, 3); see ``lines``."""
        if len(places) > 1:
            self.lines(places[:-1], places[1:], (radius, radius), colour, lift)

    def triangles(self, corners: NDArray[np.floating], colours: NDArray[np.floating]) -> None:
        """Draw triangles.

        Args:
            corners: Corners in the map [m], shape (n, 3, 3).
            colours: Colours, shape (n, 3).
        """
        projected = self.camera.project(corners.reshape(-1, 3)).reshape(-1, 3, 3)
        draw_triangles(self.colours, self.depths, projected, _for_each(colours, len(corners)))

    def pixels(self, samples: int) -> NDArray[np.uint8]:
        """Return the picture, the mean of a number of samples along either edge of a pixel."""
        height, width = self.depths.shape
        grid = (height // samples, samples, width // samples, samples, 3)
        return self.colours.reshape(grid).mean(axis=(1, 3)).clip(0, 255).astype(np.uint8)


def _for_each(colours: NDArray[np.floating], count: int) -> NDArray[np.float32]:
    """Return a colour for each of a number of things."""
    return np.ascontiguousarray(np.broadcast_to(colours, (count, 3)), dtype=np.float32)


@kernel
def _dot(
    colours: NDArray[np.float32],
    depths: NDArray[np.float32],
    x: float,
    y: float,
    depth: float,
    radius: float,
    colour: NDArray[np.float32],
) -> None:
    """Draw a disc, at least the pixel of its centre, where nothing nearer is."""
    height, width = depths.shape
    radius = max(radius, 0.5)
    for row in range(max(int(y - radius), 0), min(int(y + radius) + 1, height)):
        for column in range(max(int(x - radius), 0), min(int(x + radius) + 1, width)):
            dx, dy = column + 0.5 - x, row + 0.5 - y
            is_centre = int(x) == column and int(y) == row
            inside = is_centre or dx * dx + dy * dy <= radius * radius
            if inside and depth < depths[row, column]:
                depths[row, column] = depth
                colours[row, column] = colour


@kernel
def draw_discs(
    colours: NDArray[np.float32],
    depths: NDArray[np.float32],
    places: NDArray[np.float64],
    radii: NDArray[np.float64],
    rgb: NDArray[np.float32],
) -> None:
    """Draw discs into a canvas.

    Args:
        colours: Colour of each pixel, changed in place, shape (height, width, 3).
        depths: Depth of each pixel [m], changed in place, shape (height, width).
        places: Column, row [pixels] and depth [m] of the centres, NaN for none, shape (n, 3).
        radii: Radii [pixels], shape (n,).
        rgb: Colours of the discs, shape (n, 3).
    """
    height, width = depths.shape
    for k in range(len(places)):
        x, y, depth = places[k]
        r = radii[k]
        # Also false where they are NaN.
        if -r < x < width + r and -r < y < height + r and depth > 0:
            _dot(colours, depths, x, y, depth, r, rgb[k])


@kernel
def draw_lines(
    colours: NDArray[np.float32],
    depths: NDArray[np.float32],
    begins: NDArray[np.float64],
    ends: NDArray[np.float64],
    radii: NDArray[np.float64],
    rgb: NDArray[np.float32],
) -> None:
    """Draw lines into a canvas, as discs that overlap.

    Args:
        colours: Colour of each pixel, changed in place, shape (height, width, 3).
        depths: Depth of each pixel [m], changed in place, shape (height, width).
        begins: Column, row [pixels] and depth [m], NaN for none, shape (n, 3).
        ends: Column, row and depth of the other end, shape (n, 3).
        radii: Half of the width at either end [pixels], shape (n, 2).
        rgb: Colours of the lines, shape (n, 3).
    """
    height, width = depths.shape
    for k in range(len(begins)):
        x0, y0, z0 = begins[k]
        x1, y1, z1 = ends[k]
        if not (z0 > 0 and z1 > 0):
            continue
        if max(x0, x1) < 0 or min(x0, x1) > width or max(y0, y1) < 0 or min(y0, y1) > height:
            continue
        r0, r1 = radii[k]
        length = np.hypot(x1 - x0, y1 - y0)
        steps = min(int(length / max(0.5 * min(r0, r1), 0.5)) + 1, 4000)
        for step in range(steps + 1):
            t = step / steps
            # Along a straight line the reciprocal of the depth is linear in the picture.
            depth = 1.0 / ((1 - t) / z0 + t / z1)
            x, y = x0 + t * (x1 - x0), y0 + t * (y1 - y0)
            _dot(colours, depths, x, y, depth, r0 + t * (r1 - r0), rgb[k])


@kernel
def draw_triangles(
    colours: NDArray[np.float32],
    depths: NDArray[np.float32],
    corners: NDArray[np.float64],
    rgb: NDArray[np.float32],
) -> None:
    """Draw triangles into a canvas.

    Args:
        colours: Colour of each pixel, changed in place, shape (height, width, 3).
        depths: Depth of each pixel [m], changed in place, shape (height, width).
        corners: Column, row [pixels] and depth [m] of each corner, NaN behind, shape (n, 3, 3).
        rgb: Colours of the triangles, shape (n, 3).
    """
    height, width = depths.shape
    for k in range(len(corners)):
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = corners[k, 0], corners[k, 1], corners[k, 2]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        # Also skips corners behind the camera, which are NaN.
        if not abs(area) > 1e-9:
            continue
        top, bottom = max(int(min(ay, by, cy)), 0), min(int(max(ay, by, cy)) + 1, height)
        left, right = max(int(min(ax, bx, cx)), 0), min(int(max(ax, bx, cx)) + 1, width)
        for row in range(top, bottom):
            for column in range(left, right):
                x, y = column + 0.5, row + 0.5
                u = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area
                v = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
                w = 1.0 - u - v
                if u < 0 or v < 0 or w < 0:
                    continue
                depth = 1.0 / (u / az + v / bz + w / cz)
                if depth < depths[row, column]:
                    depths[row, column] = depth
                    colours[row, column] = rgb[k]
