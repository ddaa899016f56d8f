"""What the plans of a tick mean for telemetry, and for the robot when they come from down the ladder."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.types import (
    N_JOINTS,
    N_LEGS,
    Fallback,
    FloatArray,
    PlanReport,
    SafetyLevel,
    SafetyRequest,
)
from bluefoot_mpc.wbc import WholeBodyPlan
from bluefoot_mpc.zmp.preview import ComPlan

_KEPT = 2.0
"""s for which a request outlasts its cause."""


def _unknown(*shape: int) -> FloatArray:
    values = np.full(shape, np.nan)
    values.flags.writeable = False
    return values


_NO_COM, _NO_FORCE, _NO_TORQUE = _unknown(3, 2), _unknown(N_LEGS, 3), _unknown(N_JOINTS)


def report(com: ComPlan | None, body: WholeBodyPlan | None) -> PlanReport | None:
    """The account of a tick's plans; None where nothing was planned."""
    if com is None and body is None:
        return None
    preview = Fallback.SOLVED if com is None else com.status
    whole_body = Fallback.SOLVED if body is None else body.status
    return PlanReport(
        com=_NO_COM if com is None else com.start,
        margin=float("nan") if com is None else com.least_margin,
        foot_force=_NO_FORCE if body is None else body.foot_force,
        torque=_NO_TORQUE if body is None else body.torque,
        preview=preview,
        whole_body=whole_body,
        qp_failures=int(preview > Fallback.SOLVED) + int(whole_body > Fallback.SOLVED),
        residual=0.0 if body is None else body.residual,
    )


class StepBack:
    """What the controller itself asks for when its plans come from down the ladder: to stand, then to sit.

    A request outlasts its cause a little. At rest there is hardly anything to
    solve, so that a solver which failed under way seems to be well as soon as
    the robot stands: it would set off and stop again with every step.

    Attributes:
        request: what is asked for on the next tick.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Ask for nothing."""
        self.request = SafetyRequest()
        self._left = 0.0  # s for which the present request is kept

    def step(self, plans: PlanReport | None, dt: float) -> None:
        """Take the plans of a tick.

        Args:
            plans: None where nothing was planned.
            dt: s.
        """
        wanted = _wanted(plans)
        self._left -= dt
        if wanted.level >= self.request.level or self._left <= 0.0:
            self.request, self._left = wanted, _KEPT


def _wanted(plans: PlanReport | None) -> SafetyRequest:
    """What the plans of one tick ask for."""
    if plans is None:
        return SafetyRequest()
    rung = max(plans.preview, plans.whole_body)
    stage = "preview" if plans.preview >= plans.whole_body else "whole-body problem"
    if rung >= Fallback.SIT:
        return SafetyRequest(level=SafetyLevel.SIT, reasons=(f"no plan from the {stage} for too long",))
    if rung >= Fallback.STANCE:
        return SafetyRequest(level=SafetyLevel.HOLD, reasons=(f"no plan from the {stage}",))
    return SafetyRequest()


def more_urgent(one: SafetyRequest, other: SafetyRequest) -> SafetyRequest:
    """The request with the higher level; reasons of both where they agree on it."""
    if one.level != other.level:
        return one if one.level > other.level else other
    return SafetyRequest(level=one.level, reasons=(*one.reasons, *other.reasons))
