"""Measures of rooms that tests share: widths of ways by dilation, coverage by cells of 5 cm."""

import numpy as np
from scipy.ndimage import label

from worlds.rooms.room import CELL, cell_clearances


def obstacle_count(room, margin):
    """Return the number of separate obstacles when all grow by a margin [m], the border one.

    Two obstacles with a way between them that is narrower than twice the margin are one.
    """
    clear = np.pad(cell_clearances(room), 1, constant_values=-1.0)
    return label(clear <= margin, np.ones((3, 3)))[1]


def has_no_way_narrower_than(room, width):
    """Return True if discs of that width pass wherever a point does, within a cell's diagonal."""
    return obstacle_count(room, 0.5 * width - CELL) == obstacle_count(room, CELL / 2)


def share_of_largest_region(room, radius):
    """Return the share of the places free for a disc that its largest region holds."""
    regions, _ = label(cell_clearances(room) > radius)
    counts = np.bincount(regions.ravel())[1:]
    return counts.max() / counts.sum()


def coverage(room):
    """Return the share of a room's free space that boxes and circles cover, without what moves."""
    return float((cell_clearances(room) < 0).mean())
