"""Identification of delay, lag and accelerations from a robot's own commands and measured speeds.

A bank of candidate models is driven by the commands alone, each from its own speeds, and scored by
how far the measured speeds lie from its own, with forgetting (a Bayesian bank of models; Magill
1965). A bank, and no recursive least squares: a delay and a limited acceleration are not linear in
anything that is measured, and no start can lead it to a wrong optimum. A stable model that runs
free forgets its start after a few lags, so that noise of the speeds never enters a prediction.

The unknown gains of speed and yaw rate have a closed form in each candidate. Delay and lag are the
same for speed and yaw rate (assumption), so that turns tell about brakes.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, field_validator

from andabata.machine.kinematics import Twist
from andabata.navigation.planar.dynamics import (
    PlanarDynamics,
    advance_axis,
    axis_step,
    delayed,
)
from terrain.kernel import kernel

Values = tuple[float, ...]
"""Candidate values, ascending."""


class DynamicsIdentificationConfig(BaseModel):
    """Candidates and noise.

    The prior is even over the candidates: ranges are to be what a robot may be. The noise covers
    what no candidate explains, too: with half of it the uncertainty is a tenth of the errors that
    lie between candidates, as measured with dynamics drawn at random.

    Attributes:
        delays: Delays [s].
        lags: Time constants of the lag [s].
        accelerations: Largest accelerations [m/s2].
        yaw_accelerations: Largest yaw accelerations [rad/s2], as many as accelerations.
        speed_noise: Standard deviation of measured speeds from a true model's [m/s].
        yaw_noise: Standard deviation of measured yaw rates from a true model's [rad/s].
        gain_spread: Standard deviation of the gains from 1.
        memory: Time after which a measurement counts 37 % [s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    delays: Values = (0.0, 0.025, 0.05, 0.075, 0.1, 0.125, 0.15, 0.175, 0.2, 0.225, 0.25)
    lags: Values = (0.02, 0.05, 0.075, 0.1, 0.125, 0.15, 0.175, 0.2, 0.225, 0.25, 0.3, 0.35)
    accelerations: Values = (1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0)
    yaw_accelerations: Values = (2.5, 3.25, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.5, 12.0)
    speed_noise: float = Field(default=0.06, gt=0)
    yaw_noise: float = Field(default=0.16, gt=0)
    gain_spread: float = Field(default=0.03, gt=0)
    memory: float = Field(default=20.0, gt=0)

    @field_validator("delays", "lags", "accelerations", "yaw_accelerations")
    @classmethod
    def _check_order(cls, values: Values) -> Values:
        """Refuse candidates that are not ascending from zero on."""
        if len(values) < 2 or values[0] < 0 or (np.diff(values) <= 0).any():
            raise ValueError(f"expected two or more ascending values from 0 on, got {values}")
        return values


class DynamicsEstimate(NamedTuple):
    """Estimate with its uncertainty.

    Attributes:
        mean: Means of delay, lag and accelerations.
        deviation: Their standard deviations.
    """

    mean: PlanarDynamics
    deviation: PlanarDynamics


class _Bank(NamedTuple):
    """Candidates of one axis, by delay, lag and acceleration: d, l, a.

    Attributes:
        delays: Delays in periods, shape (d,).
        lags: Time constants [s], shape (l,).
        accelerations: Largest accelerations, shape (a,).
        controller: Speed that each robot's controller asks for, shape (d, l, a).
        body: Speed of each robot, shape (d, l, a).
        squares: Sum of squares of the bodies' speeds, shape (d, l, a).
        products: Sum of their products with the measured ones, shape (d, l, a).
        measured: Sum of squares of the measured ones, shape (1,).
    """

    delays: NDArray[np.float64]
    lags: NDArray[np.float64]
    accelerations: NDArray[np.float64]
    controller: NDArray[np.float64]
    body: NDArray[np.float64]
    squares: NDArray[np.float64]
    products: NDArray[np.float64]
    measured: NDArray[np.float64]


class DynamicsIdentification:
    """Identifies how a robot follows its commands while it drives.

    Attributes:
        config: Settings.
    """

    def __init__(self, config: DynamicsIdentificationConfig, period: float) -> None:
        """Begin with the prior.

        Args:
            config: Settings.
            period: Control period [s].
        """
        self.config, self._period = config, period
        self._keep = float(np.exp(-period / config.memory))
        self._banks = tuple(
            _bank(config, accelerations, period)
            for accelerations in (config.accelerations, config.yaw_accelerations)
        )
        self._past = np.zeros((int(max(config.delays) / period) + 2, 2))

    def reset(self) -> None:
        """Return to the prior, at rest."""
        self._past[:] = 0.0
        for bank in self._banks:
            for sums in bank[3:]:
                sums[:] = 0.0

    def update(self, command: Twist, measured: Twist) -> None:
        """Take in one control period.

        Args:
            command: Command given at its begin, within the robot's limits.
            measured: Speed and yaw rate at its end.
        """
        self._past[:-1] = self._past[1:].copy()
        self._past[-1] = command.linear, command.angular
        for axis, speed in enumerate((measured.linear, measured.angular)):
            _advance(self._banks[axis], self._past, axis, speed, self._keep, self._period)

    def estimate(self) -> DynamicsEstimate:
        """Return what is known about the dynamics so far."""
        config = self.config
        speed = _likelihood(self._banks[0], config.speed_noise, config.gain_spread)
        yaw = _likelihood(self._banks[1], config.yaw_noise, config.gain_spread)
        values = (config.delays, config.lags, config.accelerations, config.yaw_accelerations)
        moments = [
            _moments(np.array(candidates), weights)
            for candidates, weights in zip(values, _marginals(speed, yaw), strict=True)
        ]
        return DynamicsEstimate(
            PlanarDynamics(*(mean for mean, _ in moments)),
            PlanarDynamics(*(deviation for _, deviation in moments)),
        )


def _bank(config: DynamicsIdentificationConfig, accelerations: Values, period: float) -> _Bank:
    """Return the candidates of an axis, at rest."""
    shape = (len(config.delays), len(config.lags), len(accelerations))
    return _Bank(
        np.array(config.delays) / period,
        np.array(config.lags),
        np.array(accelerations),
        controller=np.zeros(shape),
        body=np.zeros(shape),
        squares=np.zeros(shape),
        products=np.zeros(shape),
        measured=np.zeros(1),
    )


def _moments(values: NDArray[np.float64], weights: NDArray[np.float64]) -> tuple[float, float]:
    """Return mean and standard deviation of weighted values."""
    mean = float(weights @ values)
    return mean, float(np.sqrt(weights @ (values - mean) ** 2))


@kernel
def _advance(
    bank: _Bank,
    past: NDArray[np.float64],
    axis: int,
    measured: float,
    keep: float,
    period: float,
) -> None:
    """Drive all candidates of an axis for a period, and add to their sums."""
    last = len(past) - 1
    bank.measured[0] = keep * bank.measured[0] + measured * measured
    for d in range(len(bank.delays)):
        command = delayed(past, last, axis, bank.delays[d])
        for g in range(len(bank.lags)):
            for a in range(len(bank.accelerations)):
                step = axis_step(bank.accelerations[a], bank.lags[g], period)
                controller, body = advance_axis(
                    bank.controller[d, g, a], bank.body[d, g, a], command, step
                )
                bank.controller[d, g, a], bank.body[d, g, a] = controller, body
                bank.squares[d, g, a] = keep * bank.squares[d, g, a] + body * body
                bank.products[d, g, a] = keep * bank.products[d, g, a] + body * measured


@kernel
def _likelihood(bank: _Bank, noise: float, spread: float) -> NDArray[np.float64]:
    """Return the likelihood of each candidate with its best gain, relative to the best one's.

    With sums of squares the error of a gain g is a parabola, to which the gain's prior adds one;
    its least value is taken.
    """
    prior = (noise / spread) ** 2
    errors = np.empty_like(bank.squares)
    least = np.inf
    for d in range(len(bank.delays)):
        for k in range(len(bank.lags)):
            for a in range(len(bank.accelerations)):
                xx, xy = bank.squares[d, k, a], bank.products[d, k, a]
                gain = (xy + prior) / (xx + prior)
                error = bank.measured[0] - 2.0 * gain * xy + gain * gain * xx
                errors[d, k, a] = error + prior * (gain - 1.0) ** 2
                least = min(least, errors[d, k, a])
    # No candidate is excluded for ever: what is known may change.
    return np.exp(-np.minimum((errors - least) / (2.0 * noise**2), 200.0))


@kernel
def _marginals(
    speed: NDArray[np.float64], yaw: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the probabilities of delays, lags, accelerations and yaw accelerations.

    Args:
        speed: Likelihoods by delay, lag and acceleration, shape (d, l, a).
        yaw: Likelihoods by delay, lag and yaw acceleration, shape (d, l, b).
    """
    delays, lags = np.zeros(speed.shape[0]), np.zeros(speed.shape[1])
    accelerations, yaw_accelerations = np.zeros(speed.shape[2]), np.zeros(yaw.shape[2])
    for d in range(len(delays)):
        for k in range(len(lags)):
            # Both axes share a delay and a lag, and have an acceleration each.
            one, other = np.sum(speed[d, k]), np.sum(yaw[d, k])
            delays[d] += one * other
            lags[k] += one * other
            accelerations += speed[d, k] * other
            yaw_accelerations += yaw[d, k] * one
    total = np.sum(delays)
    return delays / total, lags / total, accelerations / total, yaw_accelerations / total
