"""Rigid-body dynamics of the robot by Pinocchio, 22 degrees of freedom.

``M(q) v̇ + C(q, v) v + G(q) = Sᵀ τ + Jᵀ f`` (paper, chapter on dynamics), with
``q`` (23,) and ``v`` (22,) in house order: trunk twist in the base frame, linear
before angular, then sixteen joints.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.types import N_JOINTS, N_LEGS, FloatArray

_ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


class Dynamics:
    """Dynamic terms of one robot at any state.

    Every method is a function of its arguments alone and returns a new array;
    the object only owns Pinocchio's workspace, so use one per thread.

    Args:
        robot: the model.
        rotor_inertia: add the servos' rotors, seen through their gears, to the
            joints' diagonal of the mass matrix. The URDF does not hold them.
    """

    def __init__(self, robot: RobotModel, *, rotor_inertia: bool = False) -> None:
        self._model = robot.pin_model
        self._data = robot.pin_model.createData()
        self._feet = robot.foot_frame_ids
        self._zero = np.zeros(self._model.nv)
        rows, columns = np.tril_indices(self._model.nv, -1)
        self._below = rows * self._model.nv + columns
        self._above = columns * self._model.nv + rows
        self._rotor = np.zeros(self._model.nv)
        if rotor_inertia:
            self._rotor[-N_JOINTS:] = robot.parameters.servo.armature
        self.mass = float(pin.computeTotalMass(self._model))

    def mass_matrix(self, q: FloatArray) -> FloatArray:
        """(22, 22) M(q), symmetric and positive definite; kg, kg·m, kg·m²."""
        matrix: FloatArray = np.array(pin.crba(self._model, self._data, q), order="C")
        entries = matrix.reshape(-1)
        # Older versions of Pinocchio fill the upper triangle only.
        entries[self._below] = entries[self._above]
        entries[:: self._model.nv + 1] += self._rotor
        return matrix

    def bias(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """(22,) C(q, v) v + G(q): force that holds the velocity constant; N, N·m, base frame."""
        return np.array(pin.nonLinearEffects(self._model, self._data, q, v))

    def gravity(self, q: FloatArray) -> FloatArray:
        """(22,) G(q): force that holds the robot against gravity; N, N·m, base frame."""
        return np.array(pin.computeGeneralizedGravity(self._model, self._data, q))

    def coriolis(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """(22,) C(q, v) v: the velocity's share of the bias; N, N·m, base frame."""
        return self.bias(q, v) - self.gravity(q)

    def coriolis_matrix(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """(22, 22) C(q, v) of Christoffel symbols: its product with v is `coriolis`."""
        return np.array(pin.computeCoriolisMatrix(self._model, self._data, q, v))

    def foot_positions(self, q: FloatArray) -> FloatArray:
        """(4, 3) m, foot points in the world, FL, FR, RL, RR."""
        pin.framesForwardKinematics(self._model, self._data, q)
        return np.array([self._data.oMf[frame].translation for frame in self._feet])

    def foot_jacobians(self, q: FloatArray) -> FloatArray:
        """(4, 3, 22) J with ``J @ v`` the velocity of each foot point in world axes; m, 1."""
        pin.computeJointJacobians(self._model, self._data, q)
        pin.updateFramePlacements(self._model, self._data)
        jacobians = np.empty((N_LEGS, 3, self._model.nv))
        for leg, frame in enumerate(self._feet):
            jacobians[leg] = pin.getFrameJacobian(self._model, self._data, frame, _ALIGNED)[:3]
        return jacobians

    def foot_drifts(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """(4, 3) m/s², acceleration of each foot point in world axes while ``v̇ = 0``: ``dJ/dt @ v``."""
        pin.forwardKinematics(self._model, self._data, q, v, self._zero)
        pin.updateFramePlacements(self._model, self._data)
        drifts = np.empty((N_LEGS, 3))
        for leg, frame in enumerate(self._feet):
            motion = pin.getFrameClassicalAcceleration(self._model, self._data, frame, _ALIGNED)
            drifts[leg] = motion.linear
        return drifts

    def com(self, q: FloatArray) -> FloatArray:
        """(3,) m, centre of mass in the world."""
        return np.array(pin.centerOfMass(self._model, self._data, q, False))

    def centroidal_momentum(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """(6,) linear kg·m/s and angular (about the centre of mass) kg·m²/s momentum in world axes."""
        return np.array(pin.computeCentroidalMomentum(self._model, self._data, q, v).vector)

    def centroidal_matrix(self, q: FloatArray) -> FloatArray:
        """(6, 22) A with ``A @ v`` the centroidal momentum (linear, angular) in world axes."""
        return np.array(pin.computeCentroidalMap(self._model, self._data, q))

    def kinetic_energy(self, q: FloatArray, v: FloatArray) -> float:
        """J, rotors included where the mass matrix has them."""
        return float(pin.computeKineticEnergy(self._model, self._data, q, v) + 0.5 * self._rotor @ (v * v))

    def potential_energy(self, q: FloatArray) -> float:
        """J, zero with the centre of mass on the world's floor."""
        return float(pin.computePotentialEnergy(self._model, self._data, q))
