"""Where the disturbance ψ of the coming period comes from; one class per choice, one interface."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.leveling.config import LevelingConfig
from bluefoot_mpc.leveling.narx import Narx, NarxWeights, load_weights
from bluefoot_mpc.leveling.signals import INPUT_SCALE, OUTPUT_SCALE, OUTPUTS
from bluefoot_mpc.model.dynamics import Dynamics
from bluefoot_mpc.types import FloatArray

NOTHING: FloatArray = np.zeros(OUTPUTS)
NOTHING.setflags(write=False)
USELESS = 2.0
"""Power of the error over the signal's from which a network is not acted upon; persistence reaches 1.5."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Situation:
    """What a source may look at on one tick.

    Attributes:
        target: (22,) ψ_k measured over the period that just ended; None where it is unknown.
        inputs: (56,) u_k of the network.
        q: (23,) configuration; position, quaternion x y z w, joints.
        v: (22,) velocity.
        forces: (4, 3) N, estimated ground forces, world axes.
        turn: (3, 22) Γ1 M̂⁻¹, what forces do to the trunk's rotation.
        learn: whether a source that learns may.
    """

    target: FloatArray | None
    inputs: FloatArray
    q: FloatArray
    v: FloatArray
    forces: FloatArray
    turn: FloatArray
    learn: bool


class Source(Protocol):
    """Predicts ψ of the coming period.

    Attributes:
        trust: share of what is predicted that is acted upon on top of a controller, 0..1.
        mse: low-passed squared error, NaN where nothing learns.
        rate: learning rate, NaN where nothing learns.
        ready: False while a prediction is not to be used yet.
        fault: why predictions can no longer be used; empty while they can.
        doubt: why they are not to be used for now; empty while they can.
    """

    trust: float
    mse: float
    rate: float
    ready: bool
    fault: str
    doubt: str

    @property
    def weights(self) -> NarxWeights | None:
        """What it has learnt; None where nothing learns."""

    def reset(self) -> None:
        """Forget everything."""

    def step(self, situation: Situation, dt: float) -> FloatArray | None:
        """(22,) N and N·m, predicted ψ, base frame and joints; None where there is none."""


class _Plain:
    """What sources without a network have in common."""

    trust = 1.0
    mse = math.nan
    rate = math.nan
    ready = True
    fault = ""
    doubt = ""
    weights = None

    def reset(self) -> None:
        """Nothing is remembered."""


class Zero(_Plain):
    """No disturbance: the attitude part alone is left of the law."""

    def step(self, situation: Situation, dt: float) -> FloatArray | None:
        """(22,) zeros."""
        return NOTHING


class Persistence(_Plain):
    """The coming disturbance is the last one measured."""

    def step(self, situation: Situation, dt: float) -> FloatArray | None:
        """(22,) ψ_k."""
        return situation.target


class ModelDisturbance(_Plain):
    """The disturbance that Pinocchio's model and the estimated ground forces give: Jᵀ f̂ - C v - G.

    Args:
        dynamics: the robot.
    """

    def __init__(self, dynamics: Dynamics) -> None:
        self._dynamics = dynamics

    def step(self, situation: Situation, dt: float) -> FloatArray | None:
        """(22,) of the present state."""
        dynamics, q = self._dynamics, situation.q
        force = -dynamics.bias(q, situation.v)
        if situation.forces.any():
            jacobians = dynamics.foot_jacobians(q)
            force += situation.forces.ravel() @ jacobians.reshape(-1, OUTPUTS)
        return force


class Network:
    """The NARX network: learns ψ while it may, predicts it always.

    Attributes:
        trust: share that it explains of late of the angular accelerations about the horizontal axes.
        mse: low-passed squared error, scaled units.
        rate: learning rate.
        ready: True with loaded weights, or once it has learnt for long enough.
        fault: why it is out of use; empty while it is not.
        doubt: set while it predicts those clearly worse than who always says zero.

    Args:
        config: of the compensator.

    Raises:
        ConfigurationError: the weights' file does not fit.
    """

    def __init__(self, config: LevelingConfig) -> None:
        self._narx = Narx(config.narx, INPUT_SCALE, OUTPUT_SCALE)
        self._weights = load_weights(Path(config.weights)) if config.weights else None
        if self._weights is not None:
            try:
                self._narx.load_weights(self._weights)
            except ConfigurationError as error:
                raise ConfigurationError(f"{config.weights}: {error}") from error
        self._learn_time = config.schedule.learn_time
        self.reset()

    def reset(self) -> None:
        """Back to the first weights."""
        self._narx.reset()
        if self._weights is not None:
            self._narx.load_weights(self._weights)
        self._learnt = 0.0
        self._predicted: FloatArray | None = None
        self._missed = self._power = 0.0
        self._note()

    @property
    def weights(self) -> NarxWeights | None:
        """What the network has learnt; None once it has diverged."""
        return None if self._narx.diverged else self._narx.weights

    def step(self, situation: Situation, dt: float) -> FloatArray | None:
        """(22,) predicted ψ; None after a bad input, or once the network has diverged."""
        if situation.target is not None:
            self._judge(situation.target, situation.turn[:2])
            self._narx.train(situation.target, learn=situation.learn)
            self._learnt += dt if situation.learn else 0.0
        prediction = self._narx.predict(situation.inputs)
        self._predicted = prediction.value if prediction.valid else None
        self._note()
        return self._predicted

    def _judge(self, target: FloatArray, turn: FloatArray) -> None:
        """Follow how much of what turns the trunk the last prediction missed."""
        if self._predicted is None:
            return
        weight = self._narx.config.mse_weight
        wanted, missed = turn @ target, turn @ (target - self._predicted)
        self._power += weight * (float(wanted @ wanted) - self._power)
        self._missed += weight * (float(missed @ missed) - self._missed)

    def _note(self) -> None:
        self.mse, self.rate = self._narx.mse, self._narx.rate
        self.trust = max(0.0, 1.0 - self._missed / self._power) if self._power > 0.0 else 0.0
        self.ready = self._weights is not None or self._learnt >= self._learn_time - 1e-9
        self.fault = "the network has diverged" if self._narx.diverged else ""
        useless = self.ready and self._missed > USELESS * self._power
        self.doubt = "the network predicts worse than nothing" if useless else ""


def make_source(config: LevelingConfig, dynamics: Dynamics) -> Source:
    """The source that a configuration names."""
    if config.psi == "network":
        return Network(config)
    if config.psi == "model":
        return ModelDisturbance(dynamics)
    return Persistence() if config.psi == "persistence" else Zero()
