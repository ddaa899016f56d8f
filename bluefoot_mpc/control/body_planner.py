"""Ground forces and joint torques behind the planned motion: the whole-body problem of a tick.

Everything is taken as planned, not as measured: through position servos with
their lag and dry friction, torque is a feed-forward. What goes wrong meanwhile
is the business of levelling and of the servos' own stiffness.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bluefoot_mpc.control.planned_body import PlannedBody
from bluefoot_mpc.gait.gait import FootMotion, GaitOutput
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.wbc import (
    WholeBodyConfig,
    WholeBodyController,
    WholeBodyGains,
    WholeBodyInputs,
    WholeBodyModel,
    WholeBodyPlan,
)
from bluefoot_mpc.zmp.preview import ComPlan

_NO_FEEDBACK = WholeBodyGains(
    com=(0.0, 0.0), trunk=(0.0, 0.0), momentum=0.0, contact=0.0, swing=(0.0, 0.0), posture=(0.0, 0.0)
)
"""A planned state has no error to feed back."""


def _feed_forward() -> WholeBodyConfig:
    return WholeBodyConfig(gains=_NO_FEEDBACK)


@dataclass(frozen=True, kw_only=True, slots=True)
class BodyPlannerConfig:
    """The whole-body problem of the pipeline."""

    enabled: bool = False
    swing_acceleration: float = 0.0  # share of the swinging feet's planned acceleration that torques make
    problem: WholeBodyConfig = field(default_factory=_feed_forward)


@dataclass(frozen=True, kw_only=True, slots=True)
class Surroundings:
    """What else bears on the forces of a tick.

    Attributes:
        feet: planned feet over the ground; None where their acceleration has no share.
        slope: (2,) rise of the ground per metre along x and y of b'.
        voltage: V at the servos.
        derating: share of the torque that heat leaves.
        com: plan of the centre of mass; None without a preview.
    """

    feet: FootMotion | None
    slope: FloatArray
    voltage: float
    derating: float
    com: ComPlan | None


class BodyPlanner:
    """Plans forces and torques for the planned body.

    Args:
        robot: the robot.
        config: the problem.
    """

    def __init__(self, robot: RobotModel, config: BodyPlannerConfig) -> None:
        self._controller = WholeBodyController(WholeBodyModel.from_robot(robot), config.problem)
        self._no_com = np.zeros(3)
        self._swing_share = config.swing_acceleration

    def reset(self) -> None:
        """Forget the last plan."""
        self._controller.reset()

    def step(
        self,
        body: PlannedBody,
        gait: GaitOutput,
        around: Surroundings,
        dt: float,
    ) -> WholeBodyPlan:
        """Forces and torques of this tick.

        Args:
            body: the planned configuration and velocity.
            gait: which feet stand, and for how long.
            around: ground, supply and the plan of the centre of mass.
            dt: s.
        """
        swing = gait.phase.swing
        inputs = WholeBodyInputs(
            q=body.q, v=body.v, contact=~swing, com=self._no_com, trunk=body.q[3:7],
            com_acceleration=_com_acceleration(around.com), foot=gait.foot_position,
            foot_acceleration=None if around.feet is None else self._swing_share * around.feet.acceleration,
            posture=body.q[7:],
            remaining=_remaining(gait), ground=_normal(around.slope),
            voltage=around.voltage, derating=around.derating,
        )  # fmt: skip
        return self._controller.step(inputs, dt)


def _com_acceleration(plan: ComPlan | None) -> FloatArray:
    acceleration = np.zeros(3)
    if plan is not None:
        acceleration[:2] = plan.start[2]
    return acceleration


def _remaining(gait: GaitOutput) -> FloatArray | None:
    """(4,) s until each foot lifts off; None while the robot stands."""
    if not gait.phase.walking:
        return None
    return np.asarray((1.0 - gait.phase.phase) * gait.cycle_time)


def _normal(slope: FloatArray) -> FloatArray | None:
    if not slope.any():
        return None
    normal = np.array([-slope[0], -slope[1], 1.0])
    return np.asarray(normal / np.sqrt(normal @ normal))
