"""Signs of the wheels' joints: which of a side turn against the others of their side.

The wheels of one side turn alike, whatever the robot does. So a joint whose speeds are opposite to
those of its side is counted backwards. Which of two is the wrong one, the other side says: most
driving is ahead, and there all wheels turn alike. Sides that are mirrored as a whole are found by
the gyro (``wheel_signs``).
"""

import numpy as np
from numpy.typing import NDArray

from andabata.records.decoding.wheel_joints import Sides

_MIN_SQUARES = 20.0
"""Summed squares of a joint's speeds from which its sign is judged [rad2/s2]."""

_OPPOSITE = -0.8
"""Correlation of two joints of a side below which one of them is reversed."""


class JointSigns:
    """Sign of each joint, learned from the speeds that come in.

    Attributes:
        reversed_names: Names of the joints that are counted backwards.
    """

    def __init__(self, reversed_names: frozenset[str] = frozenset()) -> None:
        """Create a learner.

        Args:
            reversed_names: Joints that are known to be counted backwards, of an earlier pass.
        """
        self.reversed_names = reversed_names
        self._names: tuple[str, ...] = ()
        self._products = np.zeros((0, 0))

    def corrected(
        self, names: tuple[str, ...], sides: Sides, speeds: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the speeds of the wheels with the signs that are known so far.

        Args:
            names: Names of the wheels, the left ones first.
            sides: Indices of the left and of the right wheels among them.
            speeds: Speeds of the wheels, NaN without a number, shape (n,).
        """
        if names != self._names:
            self._names, self._products = names, np.zeros((len(names), len(names)))
        known = np.nan_to_num(speeds)
        self._products += np.outer(known, known)
        if not self.reversed_names and max(len(side) for side in sides) > 1:
            self._judge(sides)
        signs = [-1.0 if name in self.reversed_names else 1.0 for name in names]
        return speeds * signs

    def _judge(self, sides: Sides) -> None:
        """Find the joints that turn against their side."""
        sizes = np.sqrt(np.diag(self._products))
        if (sizes**2 < _MIN_SQUARES).any():
            return
        correlation = self._products / np.outer(sizes, sizes)
        if all((correlation[np.ix_(side, side)] > _OPPOSITE).all() for side in sides):
            return
        # The joint that most others turn against is the reversed one.
        signs = np.ones(len(sizes))
        for _ in signs:
            alike = signs * (np.sign(correlation) @ signs)
            if alike.min() >= 0 or self._sides_agree(correlation, signs, sides):
                break
            signs[int(np.argmin(alike))] *= -1
        if not self._sides_agree(correlation, signs, sides):
            # As many turn one way as the other: each side follows its first, then the gyro decides.
            for side in sides:
                signs[list(side)] = np.sign(correlation[side[0], list(side)])
        if self._sides_agree(correlation, signs, sides):
            self.reversed_names = frozenset(
                name for name, sign in zip(self._names, signs, strict=True) if sign < 0
            )

    @staticmethod
    def _sides_agree(
        correlation: NDArray[np.float64], signs: NDArray[np.float64], sides: Sides
    ) -> bool:
        """Return whether the wheels of each side turn alike."""
        turned = correlation * np.outer(signs, signs)
        return all(bool((turned[np.ix_(side, side)] > 0).all()) for side in sides)
