"""The network of the paper's levelling law: tapped delay lines, prediction, training one step late.

N predicts ψ of the next sample from the last n samples of the inputs and of its
own output. At time k the sample ψ_k becomes known, which is the target of the
prediction made at time k-1; so a tick is `train(ψ_k)`, then `predict(u_k)`.
Errors, MSE and weights live in scaled units: value / scale.
"""

from __future__ import annotations

import enum
import math
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.leveling.narx.config import NarxConfig, bold_driver, low_pass
from bluefoot_mpc.leveling.narx.perceptron import Perceptron, random_weights
from bluefoot_mpc.leveling.narx.weights import NarxWeights, check_scale
from bluefoot_mpc.types import FloatArray


class NarxStatus(enum.StrEnum):
    """What became of one call of `Narx.predict` or `Narx.train`."""

    OK = "ok"
    IDLE = "idle"  # a target, but no prediction that waits for it
    BAD_VALUE = "bad_value"  # NaN or infinite: nothing was taken in
    DIVERGED = "diverged"  # out of use until `reset` or `load_weights`


class Prediction(NamedTuple):
    """Predicted output of the next sample.

    Attributes:
        value: (ny,) SI units as the targets; zeros unless `valid`.
        status: why.
    """

    value: FloatArray
    status: NarxStatus

    @property
    def valid(self) -> bool:
        """True when `value` is a prediction."""
        return self.status is NarxStatus.OK


class Narx:
    """Learns on line to predict the next sample of a signal.

    Args:
        config: sizes, feedback and training.
        input_scale: (nu,) sizes in SI units that count as one, of the inputs.
        output_scale: (ny,) the same of the outputs.

    Raises:
        ConfigurationError: a scale is not finite and positive, or the first weights are too large.
    """

    def __init__(self, config: NarxConfig, input_scale: FloatArray, output_scale: FloatArray) -> None:
        check_scale("input_scale", input_scale)
        check_scale("output_scale", output_scale)
        self.config = config
        self._inputs = _Scaling(input_scale, config.value_bound)
        self._targets = _Scaling(output_scale, config.value_bound)
        nu, ny, n = len(input_scale), len(output_scale), config.delays
        sizes = (n * (nu + ny), *config.hidden, ny)
        self._perceptron = Perceptron(sizes)
        line = self._perceptron.inputs
        # Newest sample first: the older ones move back by one sample.
        self._input_line, self._output_line = line[: n * nu], line[n * nu :]
        self._first = random_weights(sizes, config.weight_scale, np.random.default_rng(config.seed))
        _check_norm("first weights", self._first, config, "lower weight_scale")
        self._fed_back = np.zeros(ny)
        self._error = np.zeros(ny)
        self._nothing = np.zeros(ny)
        self._nothing.setflags(write=False)
        self._mse_bound = ny * config.error_bound**2
        self._rate, self._mse, self._power = config.rate, 0.0, 0.0
        self._diverged = self._waiting = False
        self.reset()

    def reset(self) -> None:
        """Back to the state after `__init__`: first weights and rate, empty delay lines."""
        self._use(self._first)

    def forget(self) -> None:
        """Empty the delay lines; weights, rate, MSE, power and a divergence stay."""
        self._perceptron.inputs[:] = 0.0
        self._perceptron.output[:] = 0.0
        self._fed_back[:] = 0.0
        self._waiting = False

    @property
    def mse(self) -> float:
        """Low-passed |e|² over all outputs, in scaled units; it starts from 0."""
        return self._mse

    @property
    def power(self) -> float:
        """Low-passed |ψ|², the MSE of who always says zero: an `mse` above it is worse than nothing."""
        return self._power

    @property
    def rate(self) -> float:
        """Present learning rate γ."""
        return self._rate

    @property
    def diverged(self) -> bool:
        """Whether weights or error passed their bounds; predictions are invalid until `reset`."""
        return self._diverged

    @property
    def weights(self) -> NarxWeights:
        """A copy of the weights with all that is needed to use them again."""
        first, second, third = (layer.copy() for layer in self._perceptron.layers)
        return NarxWeights(
            layers=(first, second, third),
            delays=self.config.delays,
            input_scale=self._inputs.scale.copy(),
            output_scale=self._targets.scale.copy(),
        )

    def load_weights(self, weights: NarxWeights) -> None:
        """Go on from other weights, with the first rate and empty delay lines.

        Raises:
            ConfigurationError: sizes, delays or scales are others than this network's, or weights too large.
        """
        self._check_fit(weights)
        flat = np.concatenate([layer.ravel() for layer in weights.layers])
        _check_norm("weights", flat, self.config, "train anew")
        self._use(flat)

    def predict(self, inputs: FloatArray) -> Prediction:
        """Take in the inputs of now and predict the output of the next sample.

        Inputs that are not finite leave delay lines and weights as they are; the
        tick's prediction is invalid and the next target trains nothing.

        Args:
            inputs: (nu,) SI units.
        """
        if self._diverged:
            return Prediction(self._nothing, NarxStatus.DIVERGED)
        if not self._inputs.read(inputs):
            self._waiting = False
            return Prediction(self._nothing, NarxStatus.BAD_VALUE)
        _shift(self._input_line, self._inputs.value)
        _shift(self._output_line, self._fed_back)
        output = self._perceptron.forward()
        self._fed_back[:] = output
        self._waiting = True
        return Prediction(output * self._targets.scale, NarxStatus.OK)

    def train(self, target: FloatArray, learn: bool = True) -> NarxStatus:
        """Learn from the error of the prediction before: stochastic gradient descent, one step late.

        A prediction is compared once. Without one that waits (first tick, after a
        bad input) nothing is learnt; a target that is not finite is left out.

        Args:
            target: (ny,) SI units, the sample that the last `predict` foretold.
            learn: False follows the error alone: weights and rate stay.
        """
        if self._diverged:
            return NarxStatus.DIVERGED
        if not self._targets.read(target):
            return NarxStatus.BAD_VALUE
        if self.config.feedback == "target":
            self._fed_back[:] = self._targets.value
        if not self._waiting:
            return NarxStatus.IDLE
        self._waiting = False
        error, before, scaled = self._error, self._mse, self._targets.value
        np.subtract(self._perceptron.output, scaled, out=error)
        self._mse = low_pass(before, float(np.dot(error, error)), self.config.mse_weight)
        self._power = low_pass(self._power, float(np.dot(scaled, scaled)), self.config.mse_weight)
        self._diverged = not self._mse < self._mse_bound
        if learn and not self._diverged:
            self._rate = bold_driver(self._rate, self._mse > before, self.config)
            self._descend()
        return NarxStatus.DIVERGED if self._diverged else NarxStatus.OK

    def _check_fit(self, weights: NarxWeights) -> None:
        pairs = (
            ("inputs", len(weights.input_scale), self._inputs.size),
            ("outputs", len(weights.output_scale), self._targets.size),
            ("delays", weights.delays, self.config.delays),
            ("hidden", weights.hidden, tuple(self.config.hidden)),
        )
        for name, found, wanted in pairs:
            if found != wanted:
                raise ConfigurationError(
                    f"weights are for {name} = {found}, the network has {wanted}; "
                    f"configure it alike or train anew"
                )
        _check_same("input_scale", weights.input_scale, self._inputs.scale)
        _check_same("output_scale", weights.output_scale, self._targets.scale)

    def _descend(self) -> None:
        config, perceptron = self.config, self._perceptron
        norm = perceptron.backward(self._error)
        step = self._rate
        if 0.0 < config.gradient_bound < norm:
            step *= config.gradient_bound / norm
        # A step that alone is too long is not taken, so that no weight ever overflows.
        if not math.isfinite(step * norm) or step * norm > config.weight_bound:
            self._diverged = True
            return
        perceptron.descend(step)
        self._diverged = not perceptron.norm() < config.weight_bound

    def _use(self, flat: FloatArray) -> None:
        self._perceptron.weights[:] = flat
        self._rate = self.config.rate
        self._mse = self._power = 0.0
        self._diverged = False
        self.forget()


class _Scaling:
    """Checks, clamps and scales a signal into memory of its own."""

    __slots__ = ("_finite", "_high", "_inverse", "_low", "scale", "size", "value")

    def __init__(self, scale: FloatArray, bound: float) -> None:
        self.scale = scale.astype(np.float64)
        self.size = len(scale)
        self._inverse = 1.0 / self.scale
        self._high = bound * self.scale
        self._low = -self._high
        self._finite = np.zeros(self.size, dtype=bool)
        self.value = np.zeros(self.size)

    def read(self, signal: FloatArray) -> bool:
        """Put signal / scale into `value`; False, and `value` as before, when it is not finite.

        Raises:
            ConfigurationError: the signal has another size.
        """
        if signal.shape != (self.size,):
            raise ConfigurationError(f"a signal of shape {signal.shape} came where ({self.size},) belongs")
        np.isfinite(signal, out=self._finite)
        if not self._finite.all():
            return False
        np.minimum(signal, self._high, out=self.value)
        np.maximum(self.value, self._low, out=self.value)
        np.multiply(self.value, self._inverse, out=self.value)
        return True


def _shift(line: FloatArray, newest: FloatArray) -> None:
    """Put a sample at the head of a delay line (newest first); the oldest drops out."""
    count = len(newest)
    if len(line) > count:
        line[count:] = line[:-count].copy()
    line[:count] = newest


def _check_same(name: str, found: FloatArray, wanted: FloatArray) -> None:
    apart = np.flatnonzero(found != wanted)
    if apart.size:
        index = int(apart[0])
        raise ConfigurationError(
            f"weights were trained with {name}[{index}] = {found[index]:g}, the network has "
            f"{wanted[index]:g}; give it the same scales or train anew"
        )


def _check_norm(name: str, flat: FloatArray, config: NarxConfig, way_out: str) -> None:
    with np.errstate(over="ignore"):  # infinite is what the message is to say
        norm = float(np.linalg.norm(flat))
    if not norm < config.weight_bound:
        raise ConfigurationError(
            f"{name} of norm {norm:g} count as diverged, wanted is less than "
            f"weight_bound = {config.weight_bound:g}; raise the bound or {way_out}"
        )
