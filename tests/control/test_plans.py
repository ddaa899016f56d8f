import numpy as np
import pytest

from bluefoot_mpc.control import plans
from bluefoot_mpc.types import Fallback, PlanReport, SafetyLevel, SafetyRequest
from bluefoot_mpc.wbc import WholeBodyPlan
from bluefoot_mpc.zmp.preview import ComPlan

NONE = SafetyRequest()
DT = 0.02


def com_plan(status=Fallback.SOLVED, margin=(0.02, 0.01, np.nan)) -> ComPlan:
    n = len(margin)
    return ComPlan(
        time=0.04 * np.arange(1, n + 1), start=np.arange(6.0).reshape(3, 2), position=np.zeros((n, 2)),
        velocity=np.zeros((n, 2)), acceleration=np.zeros((n, 2)), jerk=np.zeros((n, 2)),
        zmp=np.zeros((n, 2)), margin=np.array(margin), supported=np.ones(n, dtype=bool), slack=np.zeros(3),
        status=status,
    )  # fmt: skip


def body_plan(status=Fallback.SOLVED, residual=1e-12) -> WholeBodyPlan:
    return WholeBodyPlan(
        acceleration=np.zeros(22), foot_force=np.arange(12.0).reshape(4, 3), torque=np.linspace(-1, 1, 16),
        com_acceleration=np.zeros(3), foot_acceleration=np.zeros((4, 3)), status=status, residual=residual,
        iterations=3, saturated=np.zeros(16, dtype=bool),
    )  # fmt: skip


def account(preview=Fallback.SOLVED, whole_body=Fallback.SOLVED) -> PlanReport:
    report = plans.report(com_plan(preview), body_plan(whole_body))
    assert report is not None
    return report


def test_nothing_planned_is_no_report():
    assert plans.report(None, None) is None


def test_the_report_holds_both_plans():
    report = plans.report(com_plan(), body_plan())
    np.testing.assert_array_equal(report.com, com_plan().start)
    assert report.margin == 0.01
    np.testing.assert_array_equal(report.foot_force, body_plan().foot_force)
    np.testing.assert_array_equal(report.torque, body_plan().torque)
    assert (report.qp_failures, report.residual) == (0, 1e-12)


def test_what_was_not_planned_is_nan():
    forces = plans.report(None, body_plan(Fallback.NEAREST))
    assert np.isnan(forces.com).all()
    assert np.isnan(forces.margin)
    assert (forces.preview, forces.whole_body, forces.qp_failures) == (Fallback.SOLVED, Fallback.NEAREST, 1)
    motion = plans.report(com_plan(Fallback.SHIFTED), None)
    assert np.isnan(motion.foot_force).all()
    assert np.isnan(motion.torque).all()
    assert (motion.preview, motion.whole_body, motion.qp_failures) == (Fallback.SHIFTED, Fallback.SOLVED, 1)


@pytest.mark.parametrize("preview", list(Fallback))
@pytest.mark.parametrize("whole_body", list(Fallback))
def test_the_lower_of_both_rungs_decides_and_is_named(preview, whole_body):
    report = account(preview, whole_body)
    assert report.qp_failures == (preview > Fallback.SOLVED) + (whole_body > Fallback.SOLVED)
    request = asked(report)
    rung = max(preview, whole_body)
    wanted = SafetyLevel.NONE
    if rung is Fallback.STANCE:
        wanted = SafetyLevel.HOLD
    elif rung is Fallback.SIT:
        wanted = SafetyLevel.SIT
    assert request.level is wanted
    if wanted:
        assert ("preview" in request.reasons[0]) == (preview >= whole_body)
    else:
        assert request == NONE


def asked(report) -> SafetyRequest:
    """What one tick's plans ask for."""
    step_back = plans.StepBack()
    step_back.step(report, DT)
    return step_back.request


def test_no_plan_asks_for_nothing():
    assert asked(None) == NONE


def test_a_request_outlasts_its_cause_for_two_seconds():
    step_back = plans.StepBack()
    step_back.step(account(Fallback.STANCE), DT)
    for _ in range(99):
        step_back.step(account(), DT)
        assert step_back.request.level is SafetyLevel.HOLD
    for _ in range(2):
        step_back.step(None, DT)
    assert step_back.request == NONE


def test_what_is_more_urgent_counts_at_once_and_what_is_less_waits():
    step_back = plans.StepBack()
    levels = []
    for rung in (Fallback.STANCE, Fallback.SIT, Fallback.STANCE, Fallback.SOLVED):
        step_back.step(account(whole_body=rung), DT)
        levels.append(step_back.request.level)
    assert levels == [SafetyLevel.HOLD, SafetyLevel.SIT, SafetyLevel.SIT, SafetyLevel.SIT]
    step_back.reset()
    assert step_back.request == NONE


def test_the_more_urgent_request_counts_and_equals_give_both_reasons():
    hold = SafetyRequest(level=SafetyLevel.HOLD, reasons=("silence",))
    other = SafetyRequest(level=SafetyLevel.HOLD, reasons=("no plan",))
    stop = SafetyRequest(level=SafetyLevel.STOP, reasons=("empty",))
    assert plans.more_urgent(hold, stop) is stop
    assert plans.more_urgent(stop, hold) is stop
    assert plans.more_urgent(hold, NONE) is hold
    assert plans.more_urgent(hold, other).reasons == ("silence", "no plan")
    assert plans.more_urgent(NONE, NONE) == NONE
