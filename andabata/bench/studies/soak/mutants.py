"""Damaged inputs: truncations, flipped bits, and other changes of bytes."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

import numpy as np

_LONGEST = 64
"""Largest number of bytes that are put in, left out or copied."""

_EVIL = (b"\x00", b"\xff", b"\xff\xff\xff\x7f", b"\x80", b"nan", b"1e999", b"-1", b"[", b"{", b'"')
"""Bytes that readers are not prepared for."""


def truncated(data: bytes, rng: np.random.Generator) -> bytes:
    """Return the begin of some bytes."""
    return data[: rng.integers(len(data))]


def flipped(data: bytes, rng: np.random.Generator) -> bytes:
    """Return bytes with one flipped bit."""
    changed = bytearray(data)
    changed[rng.integers(len(data))] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def mutant(data: bytes, rng: np.random.Generator) -> bytes:
    """Return bytes with one to four changes of any kind."""
    for _ in range(rng.integers(1, 5)):
        if not data:
            return data
        begin, length = int(rng.integers(len(data))), int(rng.integers(1, _LONGEST))
        piece = data[begin : begin + length]
        other = int(rng.integers(len(data)))
        data = [
            lambda d, *_: flipped(d, rng),
            lambda d, *_: truncated(d, rng),
            lambda d, b, p, o: d[:b] + rng.bytes(len(p)) + d[b + len(p) :],
            lambda d, b, p, o: d[:b] + d[b + len(p) :],
            lambda d, b, p, o: d[:o] + p + d[o:],
            lambda d, b, p, o: d[:b] + _EVIL[int(rng.integers(len(_EVIL)))] + d[b + 1 :],
        ][int(rng.integers(6))](data, begin, piece, other)
    return data


@contextmanager
def ends_within(seconds: float) -> Iterator[None]:
    """Raise an error in a block of the main thread that takes longer.

    Args:
        seconds: Longest time of the block [s].

    Raises:
        TimeoutError: If it takes longer, as soon as Python code runs again.
    """

    def fail(number: int, frame: FrameType | None) -> None:
        raise TimeoutError(f"expected an end within {seconds:g} s, got none")

    before = signal.signal(signal.SIGALRM, fail)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
