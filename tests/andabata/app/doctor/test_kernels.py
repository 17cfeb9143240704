"""All parts are compiled, and what only the drive at the end compiles is counted."""

from numba import njit

from andabata.app.doctor import kernels


def test_parts_come_before_a_drive_whose_own_compilations_are_counted(monkeypatch):
    """Each part runs once, in one process or several; the drive compiles what they left."""
    ran, done = [], []
    parts = {"one": lambda: ran.append("one"), "two": lambda: ran.append("two")}
    monkeypatch.setattr(kernels, "PARTS", parts)

    def drive(*words, time_limit):
        ran.append("drive")
        njit(lambda x: x + 1)(1)

    monkeypatch.setattr(kernels, "drive_once", drive)
    found = kernels.compile_kernels(workers=1, on_part=done.append)
    assert ran == ["one", "two", "drive"] == done
    assert found["compiled_late"] >= 1
    assert found["seconds"] >= 0.0
