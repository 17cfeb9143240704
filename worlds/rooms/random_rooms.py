"""Random rooms: thin walls and posts, to develop in what is judged elsewhere."""

import numpy as np

from worlds.rooms.room import Room, RoomPlan, cell_clearances, free_places

_ATTEMPTS = 100
"""Number of layouts that are tried until one can be driven."""

_CONNECTED = 0.97
"""Smallest share of the free places that one region has to hold."""


def random_walled_room(
    seed: int,
    half: float = 5.0,
    walls: tuple[int, int] = (7, 13),
    lengths: tuple[float, float] = (0.75, 4.0),
    posts: tuple[int, int] = (0, 3),
    radius: float = 0.2,
) -> Room:
    """Return a square room of thin walls along both axes, the same for the same seed.

    Walls may meet the boundary and each other, so that there are pockets; no way that is there is
    narrower than the disc, or it is no way.

    Args:
        seed: Seed of the layout.
        half: Half of the free space's edge [m].
        walls: Fewest and most walls.
        lengths: Shortest and longest wall [m].
        posts: Fewest and most posts.
        radius: Radius of the disc that has to reach nearly all free places [m].

    Raises:
        ValueError: If no layout can be driven.
    """
    rng = np.random.default_rng(seed)
    for _ in range(_ATTEMPTS):
        plan = _plan(rng, half, walls, lengths, posts)
        room = Room.of(f"random-{seed}", plan)
        try:
            reached, all_free = free_places(room, radius, 0.3), _free_count(room, 0.3)
        except ValueError:
            continue
        if len(reached) >= _CONNECTED * all_free:
            return room
    raise ValueError(f"room {seed}: expected a layout that can be driven, got none; fewer walls")


def _plan(
    rng: np.random.Generator,
    half: float,
    walls: tuple[int, int],
    lengths: tuple[float, float],
    posts: tuple[int, int],
) -> RoomPlan:
    """Return one random layout."""
    boxes = []
    for _ in range(int(rng.integers(walls[0], walls[1] + 1))):
        length, line = rng.uniform(*lengths), rng.uniform(0.75 - half, half - 0.75)
        begin = rng.uniform(-half, half - length)
        # A third of the walls grow out of the boundary.
        if rng.random() < 1 / 3:
            begin = -half if rng.random() < 0.5 else half - length
        end = begin + length
        along_x = rng.random() < 0.5
        boxes.append((begin, line, end, line) if along_x else (line, begin, line, end))
    count = int(rng.integers(posts[0], posts[1] + 1))
    spots = [tuple(spot) for spot in rng.uniform(1.0 - half, half - 1.0, (count, 2)).tolist()]
    return RoomPlan.model_validate(
        {"about": "random walls", "half": (half, half), "walls": boxes, "posts": spots}
    )


def _free_count(room: Room, clearance: float) -> int:
    """Return how many cells of 5 cm are clear, connected or not."""
    return int((cell_clearances(room) > clearance).sum())
