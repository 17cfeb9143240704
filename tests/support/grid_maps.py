"""Layers of ``grid_map_msgs/GridMap`` as its receivers read them."""

import numpy as np


def layer_of(message, name):
    """Return a layer, first index along x, second along y, from any start of the buffer."""
    array = message.data[list(message.layers).index(name)]
    columns, rows = (int(each.size) for each in array.layout.dim)
    values = np.asarray(array.data, dtype=np.float32).reshape(columns, rows).T
    start = (-int(message.outer_start_index), -int(message.inner_start_index))
    return np.roll(values, start, axis=(0, 1))[::-1, ::-1]
