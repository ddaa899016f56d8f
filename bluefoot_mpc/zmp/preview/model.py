"""The centre of mass as a linear inverted pendulum whose input is jerk, and what follows from it.

One axis; both behave alike. State p, v, a; the jerk is constant between samples.
With the centre of mass at a vertical distance h above a plane whose height rises
with slope s along the axes of the plan, gravity G in those axes, and the
ground's force along f = p̈ - G, the point of the plane on the line of force is
p - h / (f_z - s·f_xy) f_xy. The centre of mass rises by s·a when it follows the
plane, and by what h does on top, which leaves h / (ḧ - G_z + s·G_xy), free of
the input (Kajita 2003 for level ground).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.zmp.preview.config import PreviewConfig


@dataclass(frozen=True, kw_only=True, slots=True)
class PreviewMaps:
    """The problem of one axis as matrices; n samples.

    References r are stacked as ZMP (n), position (n), velocity (n).

    Attributes:
        hessian: (n, n) of the cost by the jerks.
        gradient: (n, 3 + 3n) of the cost by the jerks at zero, per start and references.
        free: (3n, 3) positions, velocities, accelerations by the start.
        forced: (3n, n) the same by the jerks.
        lever: s², nominal distance of the ZMP from the centre of mass per acceleration.
        optimum: (n, 3 + 3n) jerks that minimise the cost, per start and references.
        root: (n, n) T with T Tᵀ the hessian's inverse: jerks = optimum + T w costs |w|²/2 more.
    """

    hessian: FloatArray
    gradient: FloatArray
    free: FloatArray
    forced: FloatArray
    lever: float
    optimum: FloatArray
    root: FloatArray


def advance(state: Any, jerk: Any, time: float) -> list[Any]:
    """Position, velocity and acceleration after `time` s of constant jerk (any type that adds)."""
    p, v, a = state
    return [
        p + time * v + time**2 / 2.0 * a + time**3 / 6.0 * jerk,
        v + time * a + time**2 / 2.0 * jerk,
        a + time * jerk,
    ]


def preview_maps(config: PreviewConfig) -> PreviewMaps:
    """Write the problem of one axis symbolically and read its matrices off."""
    n, weights = config.samples, config.weights
    start, jerk, reference = ca.SX.sym("start", 3), ca.SX.sym("jerk", n), ca.SX.sym("reference", 3 * n)
    lever = config.height / GRAVITY
    states = []
    state = ca.vertsplit(start)
    for k in range(n):
        state = advance(state, jerk[k], config.interval)
        states.append(state)
    position, velocity, acceleration = (ca.vertcat(*column) for column in zip(*states, strict=True))
    zmp = position - lever * acceleration
    wanted_zmp, wanted_position, wanted_velocity = ca.vertsplit(reference, n)
    # The cost is half the square of these.
    errors = ca.vertcat(
        math.sqrt(weights.zmp) * (zmp - wanted_zmp),
        math.sqrt(weights.position) * (position - wanted_position),
        math.sqrt(weights.velocity) * (velocity - wanted_velocity),
        math.sqrt(weights.jerk) * jerk,
    )
    path, given = ca.vertcat(position, velocity, acceleration), ca.vertcat(start, reference)
    rate, offset = _constant(ca.jacobian(errors, jerk)), _constant(ca.jacobian(errors, given))
    hessian, gradient = rate.T @ rate, rate.T @ offset
    inverse_root = np.linalg.inv(np.linalg.cholesky(hessian))
    return PreviewMaps(
        hessian=hessian,
        gradient=gradient,
        free=_constant(ca.jacobian(path, start)),
        forced=_constant(ca.jacobian(path, jerk)),
        lever=lever,
        optimum=-inverse_root.T @ (inverse_root @ gradient),
        root=inverse_root.T.copy(),
    )


def _constant(expression: Any) -> FloatArray:
    """The numbers of an expression without symbols: what is linear has a constant derivative."""
    return np.ascontiguousarray(ca.evalf(expression).full())


def levers(
    height: float | FloatArray, rise: FloatArray | None, slope: FloatArray | None, gravity: FloatArray | None
) -> FloatArray:
    """() or (n,) s², distance of the ZMP from the centre of mass per horizontal acceleration.

    Args:
        height: m or (n,) m, vertical distance of the centre of mass above the ground plane.
        rise: (n,) m/s², second derivative of that distance; None for none.
        slope: (2,) rise of the plane per metre along x and y of the plan's frame; None for none.
        gravity: (3,) m/s² in that frame, pointing down; None for straight down.
    """
    pull = GRAVITY if gravity is None else -float(gravity[2])
    if gravity is not None and slope is not None:
        pull += float(slope @ gravity[:2])
    return np.asarray(height / (pull if rise is None else pull + rise))
