"""The whole-body controller: owns the memory, solves, checks, and never answers with garbage."""

from __future__ import annotations

import dataclasses

import numpy as np

from bluefoot_mpc.qp import QpStatus, Solver, SolverOptions, make_solver
from bluefoot_mpc.types import BoolArray, Fallback, FloatArray
from bluefoot_mpc.wbc.assembly import Assembly, Stance
from bluefoot_mpc.wbc.config import WholeBodyConfig
from bluefoot_mpc.wbc.inputs import WholeBodyInputs, WholeBodyPlan
from bluefoot_mpc.wbc.ladder import into_limits, nearest_point, static_forces, static_torque, widened
from bluefoot_mpc.wbc.model import WholeBodyModel
from bluefoot_mpc.wbc.problem import plan_layout

_VIOLATION = (
    1e-4  # of the largest torque, force and acceleration: an answer of a solver that breaks more is not used
)
_RESIDUAL = 1e-6  # of the weight: a plan that misses the dynamics by more is not used
_AT_LIMIT = 1e-5  # N·m
_NO_FOOT = "no foot stands: the plan has no ground force"
_NOT_FINITE = "state or references are not finite"


class WholeBodyController:
    """Joint accelerations, ground forces and torques for one tick after the other.

    Args:
        model: the robot.
        config: weights, gains, limits, solver.

    Raises:
        ConfigurationError: the solver's name is unknown.
    """

    def __init__(self, model: WholeBodyModel, config: WholeBodyConfig | None = None) -> None:
        self.model, self.config = model, config or WholeBodyConfig()
        self._assembly = Assembly(model, self.config)
        self._layout = plan_layout(model)
        self._residual = _RESIDUAL * model.weight
        options = SolverOptions(warm_start=False)
        feet = len(model.feet)
        sizes = [self._assembly.stance(np.arange(feet) < count).problem.size for count in range(feet + 1)]
        self._spare: dict[int, Solver] = {}  # for problems with wider limits, by standing feet
        self._solvers: list[Solver] = [make_solver(self.config.solver, size, options) for size in sizes]
        self.reset()

    def reset(self) -> None:
        """The state after init: no plan before, every foot carries fully."""
        self._assembly.reset()
        for solver in (*self._solvers, *self._spare.values()):
            solver.reset()
        self._previous: WholeBodyPlan | None = None
        self._known = self.model.posture
        self._without = 0.0  # s without a plan of its own

    def step(self, inputs: WholeBodyInputs, dt: float) -> WholeBodyPlan:
        """The plan of this tick.

        Args:
            inputs: state and references.
            dt: s since the last tick, and until the next.

        Raises:
            ConfigurationError: an input has not the length that this robot needs.
        """
        contact, assembly = np.asarray(inputs.contact, dtype=np.bool_), self._assembly
        if not assembly.fill(inputs, dt):
            return self._substitute(contact, _NOT_FINITE, dt)
        stance = assembly.assemble(contact)
        self._known = inputs.q
        if self.config.free_first:
            x = assembly.free_optimum(stance)
            if x is not None and self._holds(stance, x, 0.0):
                return self._kept(self._plan(stance, 0))
        solution = self._solvers[stance.feet].solve(stance.problem)
        if solution.status is QpStatus.SOLVED and self._holds(stance, solution.x, _VIOLATION):
            return self._kept(self._plan(stance, solution.iterations))
        return self._nearest(stance, contact, f"{self.config.solver}: {solution.status}", dt)

    def _holds(self, stance: Stance, x: FloatArray, tolerance: float) -> bool:
        """Evaluate an answer; True where it keeps dynamics, rows and bounds (False for NaN)."""
        self._assembly.evaluate(stance, x)
        plan = self._assembly.plan
        return bool(plan.violation[0] <= tolerance and plan.residual[0] <= self._residual)

    def _kept(self, plan: WholeBodyPlan) -> WholeBodyPlan:
        self._previous, self._without = plan, 0.0
        return plan

    def _plan(self, stance: Stance, iterations: int) -> WholeBodyPlan:
        """A copy of the plan that was evaluated last."""
        flat, place, feet = self._assembly.flat_plan.copy(), self._layout.slices, len(self.model.feet)
        return WholeBodyPlan(
            acceleration=flat[place["acceleration"]],
            foot_force=flat[place["force"]].reshape(feet, 3),
            torque=flat[place["torque"]],
            com_acceleration=flat[place["com"]],
            foot_acceleration=flat[place["feet"]].reshape(feet, 3),
            status=Fallback.SOLVED,
            residual=float(flat[-1]),
            iterations=iterations,
            saturated=flat[place["spare"]] < _AT_LIMIT,
            reason="" if stance.feet else _NO_FOOT,
        )

    def _nearest(self, stance: Stance, contact: BoolArray, cause: str, dt: float) -> WholeBodyPlan:
        """The problem with wider limits; torques are then cut to the envelope."""
        x, how = self._relaxed(stance)
        if x is None:
            return self._substitute(contact, f"{cause}, and no nearest point", dt)
        self._assembly.evaluate(stance, into_limits(self.model, stance.problem, x, self.config.friction))
        plan = self._plan(stance, 0)
        if not plan.residual <= self._residual:  # NaN too
            return self._substitute(contact, f"{cause}, and a nearest point that breaks the dynamics", dt)
        lowest, highest = self._envelope()
        torque = np.clip(plan.torque, lowest, highest)
        lacking = float(np.abs(torque - plan.torque).max())
        plan = dataclasses.replace(
            plan, torque=torque, status=Fallback.NEAREST, residual=max(plan.residual, lacking),
            reason=f"{how}: {cause}",
        )  # fmt: skip
        return self._kept(plan)

    def _relaxed(self, stance: Stance) -> tuple[FloatArray | None, str]:
        """(n,) an answer of wider limits by the solver, else without it; and how it came about."""
        model, problem = self.model, stance.problem
        torque = float(np.max(self._assembly.given.torque))
        wide = widened(problem, model.joints, self.config.joint_acceleration / torque)
        solver = self._spare.get(stance.feet)
        if solver is None:
            solver = make_solver(self.config.solver, wide.size, SolverOptions(warm_start=False))
            self._spare[stance.feet] = solver
        solution = solver.solve(wide)
        if solution.status is QpStatus.SOLVED:
            return solution.x[:-1], "wider limits"
        return nearest_point(problem), "nearest point"

    def _substitute(self, contact: BoolArray, cause: str, dt: float) -> WholeBodyPlan:
        """A plan that does not come from this tick: the previous one, then the static stance."""
        self._without += dt
        late = self._without - self.config.shift_time
        if self._previous is not None and late <= 0.0:
            forces = np.where(contact[:, None], self._previous.foot_force, 0.0)
            return dataclasses.replace(
                self._previous, foot_force=forces, status=Fallback.SHIFTED, residual=np.inf, iterations=0,
                reason=f"previous plan: {cause}",
            )  # fmt: skip
        sit = late > self.config.stance_time
        return self._static(contact, Fallback.SIT if sit else Fallback.STANCE, cause)

    def _static(self, contact: BoolArray, status: Fallback, cause: str) -> WholeBodyPlan:
        model, feet = self.model, len(self.model.feet)
        forces = static_forces(model, self._known, contact)
        torque = static_torque(model, self._known, forces)
        limit = self.config.torque_share * model.actuators.torque
        held = np.clip(torque, -limit, limit)
        wish = "asks to sit down" if status is Fallback.SIT else "static stance"
        return WholeBodyPlan(
            acceleration=np.zeros(model.pin_model.nv), foot_force=forces, torque=held,
            com_acceleration=np.zeros(3), foot_acceleration=np.zeros((feet, 3)), status=status,
            residual=np.inf, iterations=0, saturated=np.abs(torque) >= limit, reason=f"{wish}: {cause}",
        )  # fmt: skip

    def _envelope(self) -> tuple[FloatArray, FloatArray]:
        """(nj,) lowest and highest torque of this tick, N·m; never past zero, so that zero always fits."""
        given, actuators = self._assembly.given, self.model.actuators
        stall = given.strength[0] * given.torque
        lost = actuators.back_emf * given.v[6:]
        return np.minimum(-stall - lost, 0.0), np.maximum(stall - lost, 0.0)
