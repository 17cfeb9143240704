"""LAS files that say in which unit their coordinates are, by GeoKeys or by well-known text."""

import io
import struct

import numpy as np

GEOGRAPHIC_WKT = (
    'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],'
    'PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433],AUTHORITY["EPSG","4326"]]'
)


def projected_wkt(name="US survey foot", metres="0.3048006096012192"):
    """Return a projected system in WKT 1 with a unit of its own."""
    return (
        f'PROJCS["plane",{GEOGRAPHIC_WKT},PROJECTION["Transverse_Mercator"],'
        f'PARAMETER["scale_factor",0.9996],UNIT["{name}",{metres}],AXIS["X",EAST],AXIS["Y",NORTH]]'
    )


def vertical_wkt(name="metre", metres="1", axis="UP"):
    """Return a vertical system in WKT 1."""
    return f'VERT_CS["height",VERT_DATUM["d",2005],UNIT["{name}",{metres}],AXIS["z",{axis}]]'


def geo_keys(*keys):
    """Return the directory of GeoKeys: pairs of key and value, or quadruples of the record."""
    rows = [(key[0], 0, 1, key[1]) if len(key) == 2 else key for key in keys]
    return struct.pack("<4H", 1, 1, 0, len(rows)) + b"".join(struct.pack("<4H", *r) for r in rows)


def las_file(points, directory=None, doubles=None, text=None, packed=False, extended=False):
    """Return a LAS or LAZ file of coordinates in its own unit.

    Args:
        points: Coordinates, shape (n, 3).
        directory: Bytes of ``geo_keys``, or None.
        doubles: Numbers that the keys refer to, or None.
        text: Well-known text, or None; the header then says that it counts.
        packed: True for LAZ.
        extended: True to put the text behind the points.
    """
    import laspy

    version, form = ("1.4", 6) if text is not None else ("1.2", 3)
    header = laspy.LasHeader(point_format=form, version=version)
    header.scales, header.offsets = [0.001] * 3, np.floor(np.mean(points, axis=0))
    header.global_encoding.wkt = text is not None
    cloud = laspy.LasData(header)
    records = [(34735, directory), (34736, doubles and struct.pack(f"<{len(doubles)}d", *doubles))]
    for number, data in records:
        if data:
            header.vlrs.append(laspy.vlrs.vlr.VLR("LASF_Projection", number, "", data))
    if text is not None:
        record = laspy.vlrs.vlr.VLR("LASF_Projection", 2112, "", text.encode() + b"\0")
        if extended:
            cloud.evlrs = laspy.vlrs.vlrlist.VLRList([record])
        else:
            header.vlrs.append(record)
    cloud.x, cloud.y, cloud.z = np.asarray(points).T
    stream = io.BytesIO()
    cloud.write(stream, do_compress=packed)
    return stream.getvalue()
