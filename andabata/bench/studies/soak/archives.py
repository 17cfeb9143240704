"""Changes inside of npz archives, whose checksums would hide most changes of their bytes."""

import io
import zipfile
from collections.abc import Callable


def with_changed_entry(
    data: bytes, choose: Callable[[int], int], change: Callable[[bytes], bytes]
) -> bytes:
    """Return an archive with one changed entry and right checksums; other bytes as they are.

    Args:
        data: Archive.
        choose: Function of a number of entries that returns the index of one.
        change: Function that changes the bytes of an entry.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            entries = [(info.filename, archive.read(info)) for info in archive.infolist()]
    except Exception:  # It is no archive any more: zipfile raises many kinds.
        return data
    if not entries:
        return data
    chosen = choose(len(entries))
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for number, (name, content) in enumerate(entries):
            kept = change(content) if number == chosen else content
            archive.writestr(zipfile.ZipInfo(name), kept)
    return out.getvalue()
