"""The whole-body problem: ours, TSID's and PlaCo's, on TSID's own task and constraint set.

Tasks: centre of mass, orientation of the trunk, posture. Constraints: dynamics,
point contacts that do not move, friction pyramids, torque bounds. Beside it our
full problem, with swing feet, joint limits, torque-speed envelope and force ramps.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import placo
import tsid.tsid_pywrap as tsid

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.types import LEGS
from bluefoot_mpc.wbc import (
    Actuators,
    WholeBodyConfig,
    WholeBodyController,
    WholeBodyGains,
    WholeBodyInputs,
    WholeBodyModel,
    WholeBodyWeights,
)

FRICTION = 0.5
WEIGHTS = {"com": 0.1, "trunk": 0.05, "posture": 1e-4, "force": 1e-5}
"""Of TSID's and PlaCo's tasks, as ours."""
GAINS = {"com": (100.0, 20.0), "trunk": (150.0, 25.0), "posture": (100.0, 20.0)}
BACKENDS = ("proxsuite", "daqp")
SOLVERS = ("quadprog", "piqp", "casadi-qpoases", "casadi-qrqp")
"""Others on our problem, by the names of `bluefoot_mpc.qp`."""
DT = 0.02


class Ours:
    """Our controller.

    Args:
        robot: the robot.
        solver: name of the backend.
        full: our own task and constraint set instead of TSID's.
        free_first: try the optimum without limits before the solver, as the default does.
    """

    def __init__(self, robot: RobotModel, solver: str, full: bool = False, free_first: bool = True) -> None:
        model = WholeBodyModel.from_robot(robot)
        config = WholeBodyConfig(solver=solver, friction=FRICTION, free_first=free_first)
        if not full:
            model = WholeBodyModel.from_pinocchio(
                robot.pin_model, [f"{leg}_foot" for leg in LEGS], _torque_motors(robot), model.posture
            )
            config = replace(
                config, weights=WholeBodyWeights(swing=0.0), gains=WholeBodyGains(**GAINS), force_ramp=0.0,
                joint_acceleration=1e6,
            )  # fmt: skip
        self._controller = WholeBodyController(model, config)

    def __call__(self, inputs: WholeBodyInputs):
        return self._controller.step(inputs, DT)


def with_errors(robot: RobotModel, inputs: list[WholeBodyInputs], size: float = 1.0) -> list[WholeBodyInputs]:
    """Inputs whose references lie off the state, as feedback meets them: `size` times 3 mm and 0.01 rad.

    The pipeline plans without feedback: its inputs have no reference of place.
    """
    rng, model, data = np.random.default_rng(0), robot.pin_model, robot.pin_model.createData()
    found = []
    for i in inputs:
        com = np.array(pin.centerOfMass(model, data, i.q, i.v))
        turn = np.concatenate([np.zeros(3), rng.normal(scale=0.01 * size, size=3), np.zeros(model.nv - 6)])
        found.append(
            replace(
                i, com=com + rng.normal(scale=0.003 * size, size=3), com_velocity=np.array(data.vcom[0]),
                trunk=np.array(pin.integrate(model, i.q, turn)[3:7]),
                posture=i.q[7:] + rng.normal(scale=0.01 * size, size=16),
            )
        )  # fmt: skip
    return found


def without_extras(inputs: list[WholeBodyInputs]) -> list[WholeBodyInputs]:
    """Inputs as TSID's own set has them."""
    return [replace(i, remaining=None, foot_acceleration=None, ground=None, voltage=None) for i in inputs]


class Tsid:
    """TSID's inverse dynamics, feet on the ground fixed once."""

    def __init__(self, robot: RobotModel, contact: np.ndarray) -> None:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "robot.urdf"
            file.write_text(robot.urdf, encoding="utf-8")
            self._robot = tsid.RobotWrapper(str(file), [folder], pin.JointModelFreeFlyer(), False)
        posture = robot.default_stance()
        self.formulation = formulation = tsid.InverseDynamicsFormulationAccForce("id", self._robot, False)
        formulation.computeProblemData(0.0, posture, np.zeros(self._robot.nv))
        self._com = tsid.TaskComEquality("com", self._robot)
        self._trunk = tsid.TaskSE3Equality("trunk", self._robot, "root_joint")
        self._posture = tsid.TaskJointPosture("posture", self._robot)
        for task, name in ((self._com, "com"), (self._trunk, "trunk"), (self._posture, "posture")):
            stiffness, damping = GAINS[name]
            size = {"com": 3, "trunk": 6, "posture": self._robot.na}[name]
            task.setKp(np.full(size, stiffness))
            task.setKd(np.full(size, damping))
        self._trunk.setMask(np.array([0.0, 0, 0, 1, 1, 1]))
        self._trunk.useLocalFrame(False)
        for task, name in ((self._com, "com"), (self._trunk, "trunk"), (self._posture, "posture")):
            formulation.addMotionTask(task, WEIGHTS[name], 1, 0.0)
        self._contacts = [self._stand(leg) for leg, stands in zip(LEGS, contact, strict=True) if stands]
        self._bounds = tsid.TaskActuationBounds("bounds", self._robot)
        limit = np.full(self._robot.na, robot.parameters.servo.stall_torque)
        self._bounds.setBounds(-limit, limit)
        formulation.addActuationTask(self._bounds, 1.0, 0, 0.0)
        self._solver = tsid.SolverHQuadProgFast("qp")
        self._solver.resize(formulation.nVar, formulation.nEq, formulation.nIn)
        self._places: dict[int, np.ndarray] = {}
        self._samples = [tsid.TrajectorySample(n, m) for n, m in ((3, 3), (12, 6), (16, 16))]

    def __call__(self, inputs: WholeBodyInputs):
        com, trunk, posture = self._samples
        com.value(inputs.com)
        com.derivative(inputs.com_velocity)
        if inputs.com_acceleration is not None:
            com.second_derivative(inputs.com_acceleration)
        trunk.value(self._places[id(inputs)])
        posture.value(inputs.q[7:] if inputs.posture is None else inputs.posture)
        self._com.setReference(com)
        self._trunk.setReference(trunk)
        self._posture.setReference(posture)
        data = self.formulation.computeProblemData(0.0, inputs.q, inputs.v)
        solution = self._solver.solve(data)
        return self.formulation.getActuatorForces(solution), solution.status

    def prepare(self, instances: list[WholeBodyInputs]) -> None:
        """Turn wanted orientations into what TSID takes, which no time is charged for."""
        for inputs in instances:
            rotation = pin.Quaternion(inputs.trunk).toRotationMatrix()
            self._places[id(inputs)] = tsid.SE3ToVector(pin.SE3(rotation, np.zeros(3)))

    def _stand(self, leg: str):
        contact = tsid.ContactPoint(
            leg, self._robot, f"{leg}_foot", np.array([0.0, 0.0, 1.0]), FRICTION, 0.0, 40.0
        )
        contact.setKp(np.zeros(3))
        contact.setKd(np.full(3, 10.0))
        contact.useLocalFrame(False)
        frame = self._robot.model().getFrameId(f"{leg}_foot")
        contact.setReference(self._robot.framePosition(self.formulation.data(), frame))
        self.formulation.addRigidContact(contact, WEIGHTS["force"], 1.0, True)
        return contact


class Placo:
    """PlaCo's dynamics solver, feet on the ground fixed once."""

    def __init__(self, robot: RobotModel, contact: np.ndarray) -> None:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "robot.urdf"
            file.write_text(robot.urdf, encoding="utf-8")
            self._robot = placo.RobotWrapper(str(file), placo.Flags.ignore_collisions)
        self._robot.state.q = robot.default_stance()
        self._robot.update_kinematics()
        self._solver = solver = placo.DynamicsSolver(self._robot)
        solver.dt = DT
        for leg, stands in zip(LEGS, contact, strict=True):
            if stands:
                place = self._robot.get_T_world_frame(f"{leg}_foot")[:3, 3]
                task = solver.add_position_task(f"{leg}_foot", place)
                task.kp, task.kd = 0.0, 10.0
                foot = solver.add_unilateral_point_contact(task)
                foot.mu, foot.weight_forces = FRICTION, WEIGHTS["force"]
        self._com = solver.add_com_task(np.zeros(3))
        self._trunk = solver.add_orientation_task("trunk", np.eye(3))
        self._posture = solver.add_joints_task()
        self._names = list(self._robot.joint_names())
        for task, name in ((self._com, "com"), (self._trunk, "trunk"), (self._posture, "posture")):
            task.configure(name, "soft", WEIGHTS[name])
            task.kp, task.kd = GAINS[name]
        for name in self._names:
            self._robot.set_torque_limit(name, robot.parameters.servo.stall_torque)
        solver.enable_torque_limits(True)

    def __call__(self, inputs: WholeBodyInputs):
        robot = self._robot
        robot.state.q, robot.state.qd = inputs.q, inputs.v
        robot.update_kinematics()
        self._com.target_world, self._com.dtarget_world = inputs.com, inputs.com_velocity
        self._trunk.R_world_frame = pin.Quaternion(inputs.trunk).toRotationMatrix()
        joints = inputs.q[7:] if inputs.posture is None else inputs.posture
        self._posture.set_joints(dict(zip(self._names, joints.tolist(), strict=True)))
        result = self._solver.solve()
        return result.tau[6:], result.success


def contestants(robot: RobotModel, inputs: list[WholeBodyInputs]) -> dict[str, object]:
    """Every whole-body controller on these inputs, which stand on the same feet."""
    contact, plain = np.array(inputs[0].contact), without_extras(inputs)
    peer = Tsid(robot, contact)
    peer.prepare(plain)
    own_set = {
        "TSID": peer,
        "PlaCo": Placo(robot, contact),
        **{f"ours, {name}": Ours(robot, name) for name in BACKENDS},
        **{f"ours, {name}, solver always": Ours(robot, name, free_first=False) for name in BACKENDS},
    }
    full = {f"ours, full problem, {name}": Ours(robot, name, full=True) for name in BACKENDS}
    return {
        **{name: _on(work, plain) for name, work in own_set.items()},
        **{name: _on(work, inputs) for name, work in full.items()},
    }


def slow_contestants(robot: RobotModel, inputs: list[WholeBodyInputs]) -> dict[str, object]:
    """Other solvers behind our problem, always called."""
    plain = without_extras(inputs)
    return {
        f"ours, {name}, solver always": _on(Ours(robot, name, free_first=False), plain)
        for name in ("daqp", *SOLVERS)
    }


def agreement(robot: RobotModel, inputs: list[WholeBodyInputs]) -> dict[str, float]:
    """What makes the comparison one: TSID solves what we solve, and how often a solver was needed."""
    contact, plain = np.array(inputs[0].contact), without_extras(inputs)
    peer, ours = Tsid(robot, contact), Ours(robot, "daqp")
    peer.prepare(plain)
    plans, answers = [ours(i) for i in plain], [peer(i) for i in plain]
    gaps = [np.abs(plan.torque - torque).max() for plan, (torque, _) in zip(plans, answers, strict=True)]
    return {
        "torque_gap_median_nm": float(np.median(gaps)),
        "tsid_failed": sum(status != 0 for _, status in answers),
        "ours_not_solved": sum(plan.status != 0 for plan in plans),
        "ours_solver_needed": float(np.mean([plan.iterations > 0 for plan in plans])),
    }


def _on(work, inputs):
    return lambda k: work(inputs[k % len(inputs)])


def _torque_motors(robot: RobotModel) -> Actuators:
    """Torque bounds as TSID has them: no back-EMF, no limits of position and speed."""
    count = len(robot.joint_names)
    none = np.full(count, np.inf)
    return Actuators(
        torque=np.full(count, robot.parameters.servo.stall_torque), back_emf=np.zeros(count), speed=none,
        lower=-none, upper=none, armature=np.zeros(count),
    )  # fmt: skip
