"""Recording steps of a servo in free air, for identification.

Callers wrap this in `limp_afterwards`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.commissioning.exercise import switch_on_weak
from bluefoot_mpc.io.commissioning.steps import StepPlan, StepRecord
from bluefoot_mpc.io.dynamixel.bus import ServoBus
from bluefoot_mpc.io.dynamixel.codec import ErrorBit, error_words
from bluefoot_mpc.model.servo import FULL_DUTY

HOTTEST = 60
"""°C at which a recording ends."""
_APPROACH_SPEED = 120
"""Counts of the moving-speed register (80°/s) on the way to the middle."""
_APPROACH_TIME = 4.0
_REST = 0.25
"""s before each step, so that it starts from rest."""
_RANGE = ErrorBit.ANGLE_LIMIT | ErrorBit.RANGE


def record_steps(
    bus: ServoBus, servo: int, plan: StepPlan, clock: Clock, progress: Callable[[], None] = lambda: None
) -> list[StepRecord]:
    """Make the steps of a plan and record them; torque is off afterwards.

    Args:
        bus: where the servo hangs.
        servo: its ID.
        plan: the steps.
        clock: the bus's.
        progress: called after each step.

    Raises:
        ServoError: it does not answer, or refuses.
        DeviceError: it is too hot, does not reach the middle, or a goal lies outside its limits.
    """
    _check_room(bus, servo, plan)
    try:
        _to_middle(bus, servo, plan, clock)
        _prepare(bus, servo, plan)
        records = []
        for goal in plan.goals():
            records.append(_record(bus, servo, goal, plan, clock))
            progress()
        return records
    finally:
        bus.write(servo, "torque_enable", 0)


def _check_room(bus: ServoBus, servo: int, plan: StepPlan) -> None:
    low, high = bus.read(servo, "cw_angle_limit"), bus.read(servo, "ccw_angle_limit")
    goals = plan.goals()
    if low == high == 0 or min(goals) < low or max(goals) > high:
        raise DeviceError(
            f"servo {servo}: steps between {min(goals)} and {max(goals)} leave its limits {low}..{high}. "
            "Take smaller --amplitudes, or set it up: bluefoot servo setup"
        )
    _check_heat(servo, bus.read(servo, "present_temperature"))


def _check_heat(servo: int, temperature: int) -> None:
    if temperature >= HOTTEST:
        raise DeviceError(f"servo {servo} has {temperature} °C: too hot to step. Let it cool down")


def _to_middle(bus: ServoBus, servo: int, plan: StepPlan, clock: Clock) -> None:
    """Slowly to where the steps start."""
    for name in ("cw_compliance_margin", "ccw_compliance_margin"):
        bus.write(servo, name, plan.margin)
    for name in ("cw_compliance_slope", "ccw_compliance_slope"):
        bus.write(servo, name, plan.slope)
    bus.write(servo, "punch", plan.punch)
    switch_on_weak(bus, servo, round(FULL_DUTY * min(plan.torque_limit, 0.5)), _APPROACH_SPEED)
    bus.write(servo, "goal_position", plan.middle)
    limit = clock.now() + _APPROACH_TIME
    while abs(bus.read(servo, "present_position") - plan.middle) > 15:
        if clock.now() > limit:
            raise DeviceError(
                f"servo {servo} does not reach count {plan.middle}. Check that its horn turns freely"
            )
        clock.sleep_until(clock.now() + 0.02)


def _prepare(bus: ServoBus, servo: int, plan: StepPlan) -> None:
    """Full speed, and the torque that the plan allows."""
    bus.write(servo, "moving_speed", 0)
    bus.write(servo, "torque_limit", round(FULL_DUTY * plan.torque_limit))
    bits = ErrorBit(bus.errors.get(servo, 0)) & ~_RANGE
    if bits:
        raise DeviceError(f"servo {servo}: {error_words(int(bits))}. Mend that, then identify again")


def _record(bus: ServoBus, servo: int, goal: int, plan: StepPlan, clock: Clock) -> StepRecord:
    clock.sleep_until(clock.now() + _REST)
    start = float(np.median([bus.read(servo, "present_position") for _ in range(5)]))
    sent = clock.now()
    bus.write(servo, "goal_position", goal)
    times, positions, volts, heat = [], [], [], 0
    while clock.now() - sent < plan.duration:
        block = bus.read_block(servo, 36, 8)
        # The servo reads its shaft when the request has reached it.
        times.append(bus.wire.asked_at - sent)
        positions.append(float(int.from_bytes(block[0:2], "little")))
        volts.append(0.1 * block[6])
        heat = block[7]
    _check_heat(servo, heat)
    return StepRecord(
        servo=servo, start=start, goal=goal, time=np.array(times), position=np.array(positions),
        voltage=float(np.mean(volts)), torque_limit=plan.torque_limit,
        slope=float(plan.slope), margin=float(plan.margin), punch=float(plan.punch),
    )  # fmt: skip
