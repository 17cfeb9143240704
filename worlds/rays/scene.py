"""Ray casting against a world: what a lidar's beams hit, and how far away."""

import numpy as np
from numpy.typing import NDArray

from worlds.rays.layout import build_layout
from worlds.rays.walk import NO_TIMES, cast_rays
from worlds.world import World


class RayScene:
    """A world prepared for ray casting.

    Attributes:
        layout: Arrays of the world that compiled code reads.
    """

    def __init__(self, world: World) -> None:
        """Prepare a world.

        Args:
            world: World whose ground and objects rays are cast against.

        Raises:
            ValueError: If an object is not convex.
        """
        self.layout = build_layout(world)

    def cast(
        self,
        rays: NDArray[np.float32],
        optical_depths: NDArray[np.float32],
        max_range: float = np.inf,
        times: NDArray[np.float64] | None = None,
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Return the first hit of each ray, where leaves of porous objects stop rays.

        In porous objects, seen from anywhere, the free path is exponential with rate
        ``hits_per_metre`` (Beer-Lambert law); in one place the same leaves stop all rays, see
        ``worlds.rays.objects``. Porous objects may overlap, and a ray may begin inside of one.

        Args:
            rays: Origin in the map [m] and unit direction of each ray, float32, shape (n, 6).
            optical_depths: Depth in porous objects at which each ray ends, float32, shape (n,):
                standard exponential draws, 0 to end at the first face, or infinity to ignore
                porous objects.
            max_range: Largest range [m]; a hit beyond it counts as none.
            times: Time of each ray [s], shape (n,), for leaves in wind; None for time 0.

        Returns:
            Ranges [m], float32, shape (n,), ``inf`` without a hit, and semantic classes, uint8,
            shape (n,), ``NO_CLASS`` without a hit.
        """
        ranges = np.empty(len(rays), dtype=np.float32)
        classes = np.empty(len(rays), dtype=np.uint8)
        when = NO_TIMES if times is None else times
        cast_rays(rays, optical_depths, when, max_range, self.layout, ranges, classes)
        return ranges, classes
