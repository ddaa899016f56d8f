"""Preview gain without constraints: the steady regulator that looks ahead (Kajita et al. 2003)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_discrete_are

from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.zmp.preview.config import PreviewConfig
from bluefoot_mpc.zmp.preview.model import advance


class PreviewGain(NamedTuple):
    """Law ``jerk = -state · x + Σ_j preview[j] · (zmp, position, velocity wanted j + 1 samples ahead)``.

    Attributes:
        state: (3,) gain on position, velocity and acceleration.
        preview: (n, 3) gain on what is wanted ahead.
    """

    state: FloatArray
    preview: FloatArray


def preview_gain(config: PreviewConfig) -> PreviewGain:
    """Gain that minimises the preview's cost over an endless horizon.

    It is found by the algebraic Riccati equation; references count for as many
    samples as the horizon has.
    """
    weights, lever = config.weights, config.height / GRAVITY
    a, b = _system(config)
    outputs = np.array([[1.0, 0.0, -lever], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    prices = np.diag([weights.zmp, weights.position, weights.velocity])
    cost = solve_discrete_are(a, b[:, None], outputs.T @ prices @ outputs, np.array([[weights.jerk]]))
    scale = weights.jerk + b @ cost @ b
    state = b @ cost @ a / scale
    closed = a - np.outer(b, state)
    preview = np.empty((config.samples, 3))
    backward = b / scale
    for row in preview:
        row[:] = backward @ outputs.T @ prices
        backward = backward @ closed.T
    return PreviewGain(state=state, preview=preview)


def gain_map(config: PreviewConfig) -> FloatArray:
    """(n, 3 + 3n) jerks of the horizon by start and stacked references, as `PreviewMaps.optimum`.

    Past the horizon the last references hold on.
    """
    n, gain = config.samples, preview_gain(config)
    a, b = _system(config)
    jerks = np.zeros((n, 3 + 3 * n))
    state = np.zeros((3, 3 + 3 * n))
    state[:, :3] = np.eye(3)
    for k in range(n):
        jerks[k] = -gain.state @ state
        for ahead, shares in enumerate(gain.preview, start=k):
            jerks[k, 3 + min(ahead, n - 1) + n * np.arange(3)] += shares
        state = a @ state + np.outer(b, jerks[k])
    return jerks


def _system(config: PreviewConfig) -> tuple[FloatArray, FloatArray]:
    """(3, 3) and (3,) of one step: next state by state and jerk."""
    a = np.array(advance(np.eye(3), np.zeros(3), config.interval))
    b = np.array([float(value) for value in advance(np.zeros(3), 1.0, config.interval)])
    return a, b
