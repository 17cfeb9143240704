"""PCD files in any spelling, with the pose that they were measured from."""

import struct

import numpy as np

IDENTITY = "0 0 0 1 0 0 0"


def pcd_file(points, viewpoint=IDENTITY, form="binary", spell=str.upper):
    """Return a PCD file of points, shape (n, 3).

    Args:
        points: Coordinates of the points.
        viewpoint: Words after ``VIEWPOINT``; None leaves the line out.
        form: ``ascii``, ``binary`` or ``binary_compressed``.
        spell: Function that spells keywords, types and the form.
    """
    rows = np.asarray(points, dtype="<f4")
    lines = [("version", "0.7"), ("fields", "x y z"), ("size", "4 4 4"), ("type", spell("f f f"))]
    lines += [("count", "1 1 1"), ("width", f"{len(rows)}"), ("height", "1")]
    lines += [("viewpoint", viewpoint)] if viewpoint is not None else []
    lines += [("points", f"{len(rows)}"), ("data", form if spell is str.upper else spell(form))]
    head = "".join(f"{spell(name)} {words}\n" for name, words in lines).encode()
    if form == "ascii":
        return head + "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in rows.tolist()).encode()
    if form == "binary":
        return head + rows.tobytes()
    flat = rows.T.tobytes()
    runs = [flat[k : k + 32] for k in range(0, len(flat), 32)]
    packed = b"".join(bytes([len(run) - 1]) + run for run in runs)  # LZF of literals alone.
    return head + struct.pack("<II", len(packed), len(flat)) + packed
