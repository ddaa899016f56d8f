"""Moving one servo after another a little, weak and slow, to see that it follows.

Callers wrap this in `limp_afterwards`. A servo is only switched on with its goal
where it stands, its torque limit low and its speed limited.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.commissioning.survey import ServoFacts, look_at
from bluefoot_mpc.io.dynamixel.bus import ServoBus
from bluefoot_mpc.io.dynamixel.units import DIRECTION, load_from_register
from bluefoot_mpc.settings import require_range

_READING = 0.02
"""s between readings."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ExerciseConfig:
    """How far, how strong and how fast."""

    amplitude: int = 34  # counts (10°) towards the middle of the servo's range
    torque_limit: float = 0.4  # share of full duty
    speed: int = 90  # counts of the moving-speed register (60°/s)
    tolerance: int = 12  # counts (3.5°) that the end may differ by: friction holds a weak servo short of it
    patience: float = 1.5  # s until it must be there
    hottest: int = 60  # °C above which a servo is left alone

    def __post_init__(self) -> None:
        require_range(5, 200, amplitude=self.amplitude)
        require_range(0.05, 1.0, torque_limit=self.torque_limit)
        require_range(10, 500, speed=self.speed)
        require_range(2, 40, tolerance=self.tolerance)
        require_range(0.2, 20.0, patience=self.patience)


@dataclass(frozen=True, kw_only=True, slots=True)
class ExerciseResult:
    """How a servo moved.

    Attributes:
        servo: its ID.
        start: counts before.
        reached: counts that it moved by, there and back.
        asked: counts that it was asked to move by, signed.
        peak_load: share of full duty, largest it reported.
        temperature: °C, highest it reported.
        voltage: V, lowest it reported.
        time: s until it first came within the tolerance of the far goal; NaN where it did not.
        fault: what is wrong; empty where it follows.
        mend: what to do about it.
    """

    servo: int
    start: int = 0
    asked: int = 0
    reached: tuple[int, int] = (0, 0)
    peak_load: float = 0.0
    temperature: int = 0
    voltage: float = 0.0
    time: float = float("nan")
    fault: str = ""
    mend: str = ""


@dataclass(slots=True)
class _Log:
    """Extremes of what a servo reported."""

    load: float = 0.0
    temperature: int = 0
    voltage: float = 99.0


def exercise(bus: ServoBus, servo: int, clock: Clock, config: ExerciseConfig) -> ExerciseResult:
    """Move one servo there and back; its torque is off before and after.

    Raises:
        ServoError: it does not answer, or refuses.
    """
    facts = look_at(bus, servo)
    refused = _refusal(facts, config)
    if refused:
        return ExerciseResult(servo=servo, fault=refused[0], mend=refused[1], start=facts["present_position"])
    start = facts["present_position"]
    far = _far_goal(facts, config.amplitude)
    log = _Log()
    switch_on_weak(bus, servo, round(1023 * config.torque_limit), config.speed)
    try:
        there, time = _go(bus, servo, far, clock, config, log)
        back, _ = _go(bus, servo, start, clock, config, log)
    finally:
        bus.write(servo, "torque_enable", 0)
    asked = far - start
    fault, mend = _judge(asked, there - start, back - start, config)
    return ExerciseResult(
        servo=servo, start=start, asked=asked, reached=(there - start, back - start), time=time,
        peak_load=log.load, temperature=log.temperature, voltage=log.voltage, fault=fault, mend=mend,
    )  # fmt: skip


def switch_on_weak(bus: ServoBus, servo: int, torque_limit: int, speed: int) -> int:
    """Torque on where the servo stands: present position as the goal, limited in torque and speed.

    Returns:
        The position, counts.
    """
    position = bus.read(servo, "present_position")
    bus.write(servo, "torque_limit", torque_limit)
    bus.write(servo, "moving_speed", speed)
    bus.write(servo, "goal_position", position)
    bus.write(servo, "torque_enable", 1)
    return position


def _refusal(facts: ServoFacts, config: ExerciseConfig) -> tuple[str, str] | None:
    if facts["present_temperature"] >= config.hottest:
        return f"{facts['present_temperature']} °C, too hot to be moved", "Let it cool down"
    if facts.error:
        return facts.errors, "Mend the cause, then switch the servos' power off and on"
    low, high = facts.limits
    if low == high == 0:
        return "it is in wheel mode (both angle limits 0)", "Set it up: bluefoot servo setup"
    if not low <= facts["present_position"] <= high:
        text = f"it stands at {facts['present_position']}, outside its limits {low}..{high}"
        return text, "Turn the joint inside by hand, or set the limits: bluefoot servo setup"
    return None


def _far_goal(facts: ServoFacts, amplitude: int) -> int:
    """A goal towards the middle of the servo's limits."""
    low, high = facts.limits
    position = facts["present_position"]
    way = 1 if position <= (low + high) // 2 else -1
    return min(max(position + way * amplitude, low), high)


def _go(
    bus: ServoBus, servo: int, goal: int, clock: Clock, config: ExerciseConfig, log: _Log
) -> tuple[int, float]:
    """Send a goal and watch until the servo rests: counts at the end, and s until it was near."""
    bus.write(servo, "goal_position", goal)
    sent = clock.now()
    near, last, still = float("nan"), -1, 0
    while clock.now() - sent < config.patience and still < 5:
        clock.sleep_until(clock.now() + _READING)
        block = bus.read_block(servo, 36, 8)
        position = int.from_bytes(block[0:2], "little")
        load = int.from_bytes(block[4:6], "little")
        log.load = max(log.load, abs(load_from_register(load & ~DIRECTION)))
        log.voltage = min(log.voltage, 0.1 * block[6])
        log.temperature = max(log.temperature, block[7])
        if math.isnan(near) and abs(position - goal) <= config.tolerance:
            near = clock.now() - sent
        still = still + 1 if position == last and not math.isnan(near) else 0
        last = position
    return last, near


def _judge(asked: int, there: int, back: int, config: ExerciseConfig) -> tuple[str, str]:
    if abs(there) < 0.25 * abs(asked):
        return (
            f"it does not move: {there} of {asked} counts",
            "Check supply, gear and horn; is the joint blocked?",
        )
    if asked * there < 0:
        return (
            f"it moves the wrong way: {there} of {asked} counts",
            "Its position sensor is broken: replace it",
        )
    if abs(there - asked) > config.tolerance:
        return (
            f"it does not follow: {there} of {asked} counts",
            "Free the joint, or allow more: --torque-limit",
        )
    if abs(back) > config.tolerance:
        return f"it does not come back: {back} counts off", "Free the joint, or allow more: --torque-limit"
    return "", ""


def exercise_all(
    buses: dict[int, ServoBus],
    clock: Clock,
    config: ExerciseConfig,
    progress: Callable[[], None] = lambda: None,
) -> tuple[ExerciseResult, ...]:
    """Move servos one after the other, each on its own port."""
    results = []
    for servo, bus in buses.items():
        results.append(exercise(bus, servo, clock, config))
        progress()
    return tuple(results)
