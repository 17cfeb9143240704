"""Places on the ground that are clicked at in the scene."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from worlds.world import World

if TYPE_CHECKING:
    import viser

_STEP, _FAR = 0.1, 300.0
"""Step along the ray of a click, and its length [m]."""


class GroundClick:
    """Waits for a click in the scene and finds the place on the ground under it."""

    def __init__(self, server: "viser.ViserServer", world: World | None) -> None:
        """Take the scene.

        Args:
            server: Server of the page.
            world: World whose ground is clicked at; None takes the plane under the robot.
        """
        self._scene, self._world = server.scene, world

    def wait(
        self,
        offset: Callable[[], NDArray[np.float64]],
        foot: Callable[[], float],
        chosen: Callable[[NDArray[np.float64]], None],
    ) -> None:
        """Take the next click.

        Args:
            offset: Function that returns the position of the map's origin in the scene [m].
            foot: Function that returns the height of the robot's foot in the map [m].
            chosen: Function that takes the place in the map [m], shape (2,).
        """

        def clicked(event: "viser.SceneClickEvent") -> None:
            self._scene.remove_click_callback(clicked)
            origin = np.array(event.ray_origin) - offset()
            if self._world is None:
                place = plane_hit(origin, np.array(event.ray_direction), foot())
            else:
                place = ground_hit(origin, np.array(event.ray_direction), self._world)
            if place is not None:
                chosen(place)

        self._scene.on_click()(clicked)


def ground_hit(
    origin: NDArray[np.float64], direction: NDArray[np.float64], world: World
) -> NDArray[np.float64] | None:
    """Return the place where a ray meets the ground, in the map [m], shape (2,); None if nowhere.

    Args:
        origin: Begin of the ray in the map [m], shape (3,).
        direction: Its direction, shape (3,).
        world: World of the ground, whose edge ends it.
    """
    unit = direction / np.linalg.norm(direction)
    points = origin + np.arange(0.0, _FAR, _STEP)[:, None] * unit
    ground = world.ground
    inside = (np.abs(points[:, 0]) < ground.width / 2) & (np.abs(points[:, 1]) < ground.depth / 2)
    below = inside & (points[:, 2] <= ground.height_at(points[:, 0], points[:, 1]))
    return points[int(below.argmax()), :2] if below.any() else None


def plane_hit(
    origin: NDArray[np.float64], direction: NDArray[np.float64], height: float
) -> NDArray[np.float64] | None:
    """Return the place where a ray meets a level plane, as ``ground_hit`` does.

    Args:
        origin: Begin of the ray in the map [m], shape (3,).
        direction: Its direction, shape (3,).
        height: Height of the plane [m].
    """
    if direction[2] >= -1e-6 * np.linalg.norm(direction):
        return None
    return np.asarray((origin + direction * (height - origin[2]) / direction[2])[:2])
