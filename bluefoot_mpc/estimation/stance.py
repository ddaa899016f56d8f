"""Which feet stand, and what they tell the filter."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.estimation.config import ContactConfig
from bluefoot_mpc.estimation.corrections import correct, distances, forget_velocity, plant_feet
from bluefoot_mpc.estimation.filter import FEET, VELOCITY, FilterState
from bluefoot_mpc.estimation.inertial import rotation_matrix
from bluefoot_mpc.types import N_LEGS, FloatArray

# Rows of the filter's feet for every subset of legs, by its bits.
_ROWS = tuple(
    np.concatenate([FEET[3 * leg : 3 * leg + 3] for leg in range(N_LEGS) if mask >> leg & 1] or [FEET[:0]])
    for mask in range(1 << N_LEGS)
)
_UNIT = np.eye(3)


class FootMeasurement(NamedTuple):
    """Feet as the kinematics see them.

    Attributes:
        points: (4, 3) m, relative to the IMU, base axes.
        noise: (4, 3, 3) m², covariances in world axes.
        rotation: (3, 3) rotation_base_to_world that was used for the noise, the predicted one.
    """

    points: FloatArray
    noise: FloatArray
    rotation: FloatArray


class StanceState(NamedTuple):
    """Memory of the choice of stance feet.

    Attributes:
        settled: frames for which each foot has stood still under its switch.
        blind: s since a foot was last used.
        used: feet that the last correction used.
    """

    settled: tuple[int, ...] = (0,) * N_LEGS
    blind: float = 0.0
    used: tuple[int, ...] = ()


def measure_feet(
    rotation: FloatArray, points: FloatArray, jacobians: FloatArray, config: ContactConfig
) -> FootMeasurement:
    """Feet as measured, with the noise that the joints' rounding gives them.

    Args:
        rotation: (3, 3) rotation_base_to_world.
        points: (4, 3) m, relative to the IMU, base axes.
        jacobians: (4, 3, 4) m/rad of them by the joints, base axes.
        config: noise figures.
    """
    levers = rotation @ jacobians
    noise = config.joint_noise**2 * (levers @ levers.transpose(0, 2, 1))
    noise += config.foot_noise**2 * _UNIT
    return FootMeasurement(points, noise, rotation)


def advance_stance(
    state: FilterState, stance: StanceState, feet: FootMeasurement, standing: list[bool], *, dt: float,
    config: ContactConfig,
) -> tuple[FilterState, StanceState]:  # fmt: skip
    """Correct the filter by the feet that stand still; take all others up anew.

    A foot counts once it has stood still for the probation under a closed
    switch, and not in a frame where its motion does not fit the IMU's: it
    slips, is lifting before the switch has told, or the switch is stuck. After a
    while without any such foot, the velocity is taken up anew if feet stand; in
    the air or on its belly the robot is assumed near rest, weakly, so that
    velocity and tilt stay bounded.

    Args:
        state: filter, predicted to now.
        stance: memory.
        feet: measured.
        standing: (4,) feet under closed switches, with known joints.
        dt: s.
        config: gates.
    """
    residual = feet.points @ feet.rotation.T - state.feet
    fits = [d < config.gate for d in distances(state, residual, feet.noise)]
    settled = tuple(
        (count + 1 if count == 0 or fit else 0) if stand else 0
        for count, fit, stand in zip(stance.settled, fits, standing, strict=True)
    )
    used = tuple(leg for leg in range(N_LEGS) if settled[leg] > config.probation + 1)
    blind = 0.0 if used else stance.blind + dt
    if used:
        legs = list(used)
        noise = _block_diagonal(feet.noise[legs])
        rows = _ROWS[sum(1 << leg for leg in used)]
        state = correct(state, rows, residual[legs].reshape(-1), noise)
    elif blind > config.blind_after:
        if any(standing):
            # Feet stand, yet none fits: it is the velocity that is wrong.
            state, blind = forget_velocity(state, config.blind_speed), 0.0
        else:
            velocity = np.array(state.velocity)
            state = correct(state, VELOCITY, -velocity, config.blind_speed**2 * np.eye(3))
    others = [leg for leg in range(N_LEGS) if leg not in used]
    if others:
        points = feet.points @ rotation_matrix(state.quaternion).T
        state = plant_feet(state, others, points, feet.noise)
    return state, StanceState(settled, blind, used)


def rolling(
    radius: float, rotation: FloatArray, turn: FloatArray, direction: list[float], bend: list[float]
) -> FloatArray:
    """Way of the foot points when the balls around them roll on level ground.

    Args:
        radius: m, of the ball.
        rotation: (3, 3) rotation_base_to_world.
        turn: (3,) rad, rotation of the trunk since the last frame, base frame.
        direction: (4,) rad, directions of the legs' vertical planes about the base's z.
        bend: (4,) rad, change of the last links' angles in those planes.

    Returns:
        (4, 3) m, world axes.
    """
    # A positive angle raises the outer link: it turns about (sin, -cos, 0).
    links = [(math.sin(d) * a, -math.cos(d) * a, 0.0) for d, a in zip(direction, bend, strict=True)]
    return ((np.array(links) + turn) @ rotation.T) @ (radius * _ROLL)


# Way per turn of a ball on level ground: omega cross z.
_ROLL = np.array(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)))


def _block_diagonal(blocks: FloatArray) -> FloatArray:
    n = len(blocks)
    matrix = np.zeros((n, 3, n, 3))
    for k in range(n):
        matrix[k, :, k, :] = blocks[k]
    return matrix.reshape(3 * n, 3 * n)
