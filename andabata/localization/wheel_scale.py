"""Scale of the wheels by the satellite fixes: the way that each of them says, laid over the other.

The fixes of some seconds are fitted by the way of the wheels, turned and scaled. The scale is that
of an error of the encoders, or of wheels that spin, if the shapes agree: fixes that jump have
another shape, and prove nothing.
"""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field


class WheelScaleConfig(BaseModel):
    """Limits beyond which the fixes contradict the wheels.

    Attributes:
        fixes: Number of fixes that are compared.
        time: Time after which a fix is forgotten [s].
        ratio: Ratio of the two ways that is no slip any more.
        sigmas: Least difference of the ratio from 1 in its own standard deviations.
        least_noise: Least standard deviation of a fix [m].
        most_noise: Largest one with which fixes prove something [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    fixes: int = Field(default=16, ge=6)
    time: float = Field(default=25.0, gt=0)
    ratio: float = Field(default=1.5, gt=1)
    sigmas: float = Field(default=5.0, gt=0)
    least_noise: float = Field(default=0.3, gt=0)
    most_noise: float = Field(default=0.6, gt=0)


class WheelScale:
    """Compares the way by the wheels with the fixes.

    Attributes:
        is_wrong: True if the fixes contradict the wheels, false if they agree, None without proof.
    """

    def __init__(self, config: WheelScaleConfig) -> None:
        """Begin without any fix.

        Args:
            config: Limits.
        """
        self._config = config
        self._pairs: deque[tuple[float, complex, complex]] = deque(maxlen=config.fixes)
        self.is_wrong: bool | None = None

    def add(self, stamp: float, fix: NDArray[np.float64], way: NDArray[np.float64]) -> None:
        """Compare a fix with the way by the wheels.

        Args:
            stamp: Time of the fix [s].
            fix: Its place in the map [m], shape (2,).
            way: Sum of the robot's steps by the wheels until then, in the map's axes [m], shape
                (2,).
        """
        pairs, config = self._pairs, self._config
        pairs.append((stamp, complex(*fix), complex(*way)))
        while stamp - pairs[0][0] > config.time:
            pairs.popleft()
        self.is_wrong = self._judge() if len(pairs) == config.fixes else None

    @property
    def begin(self) -> float:
        """Stamp of the first fix that is compared [s]; infinity without any."""
        return self._pairs[0][0] if self._pairs else math.inf

    def _judge(self) -> bool | None:
        """Return ``is_wrong`` by a fit of the fixes."""
        config = self._config
        fixes, ways = (np.array(values) for values in list(zip(*self._pairs, strict=True))[1:])
        factor, noise, spread = _fit(fixes, ways)
        sigma = max(noise, config.least_noise) / max(math.sqrt(spread), 1e-9)
        ratio = abs(factor)
        if noise > config.most_noise or config.sigmas * sigma > 1:
            return None
        if 1 / config.ratio < ratio < config.ratio:
            return False
        if abs(ratio - 1) < config.sigmas * sigma:
            return None
        # A detour of the signals lasts some seconds: it is not in both halves.
        half = len(fixes) // 2
        parts = (abs(_fit(fixes[:half], ways[:half])[0]), abs(_fit(fixes[half:], ways[half:])[0]))
        bound = math.sqrt(config.ratio)
        agree = min(parts) > bound if ratio > 1 else max(parts) < 1 / bound
        return True if agree else None


def _fit(
    fixes: NDArray[np.complex128], ways: NDArray[np.complex128]
) -> tuple[complex, float, float]:
    """Return the turn and scale that lay ways over fixes, in the plane of complex numbers.

    Args:
        fixes: Places by the fixes [m], shape (n,).
        ways: Places by the wheels [m], shape (n,).

    Returns:
        The factor, the standard deviation of what is left on each axis [m], and the sum of the
        squared distances of the ways from their middle [m2].
    """
    fixes, ways = fixes - fixes.mean(), ways - ways.mean()
    spread = float((np.abs(ways) ** 2).sum())
    factor = complex((ways.conj() * fixes).sum()) / max(spread, 1e-9)
    rest = float((np.abs(fixes - factor * ways) ** 2).sum()) / (2 * len(fixes) - 4)
    return factor, math.sqrt(rest), spread
