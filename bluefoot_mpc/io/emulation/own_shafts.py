"""Single joints for emulated servos: motors on a bench, each with parameters of its own.

The law is that of `bluefoot_mpc.model.servo`, with a rotor that has inertia, dry
and viscous friction, and optionally a weight on a lever or play in the gear.
Steps of 1 ms; friction is solved implicitly, so a joint that sticks stands still
exactly, and while all stand still nothing is computed.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.emulation.own_shafts_bank import (
    STEP,
    ShaftBank,
    ShaftConfig,
    Supply,
    bench_servo,
)
from bluefoot_mpc.io.emulation.shafts import ShaftDrive, ShaftState
from bluefoot_mpc.settings import require_finite, require_nonnegative

__all__ = ["OwnShafts", "ShaftConfig", "Supply", "bench_servo"]

_EPSILON = 1e-6
_REST_AFTER = 64
"""Steps after which joints that stand still are no longer stepped, only cooled."""


class OwnShafts:
    """Joints of their own behind emulated servos, advanced lazily.

    Args:
        joints: how many equal joints, or one configuration for each.
        supply: what feeds them.

    Attributes:
        configs: of the joints.
        nominal_supply: V of the supply without load, at the start.
    """

    def __init__(self, joints: int | Sequence[ShaftConfig], supply: Supply | None = None) -> None:
        self.configs = (ShaftConfig(),) * joints if isinstance(joints, int) else tuple(joints)
        if not self.configs:
            raise ConfigurationError("shafts without a joint: give at least one")
        supply = supply or Supply()
        self.nominal_supply = supply.voltage
        self._bank = ShaftBank(self.configs, supply)
        self._drives = [ShaftDrive()] * len(self.configs)
        self._waiting: deque[tuple[float, int, ShaftDrive]] = deque()
        self._origin = math.nan  # s, when time began
        self._steps = 0  # since then
        self._asked = math.nan  # s, newest time that was asked for

    def advance(self, time: float) -> None:
        """Let the physics pass until `time` (s); the first call sets where time begins."""
        if math.isnan(self._origin):
            if math.isfinite(time):
                self._origin = self._asked = time
            return
        if time <= self._asked:
            return
        self._asked = time
        bank = self._bank
        # Steps lie on a grid, so that it does not matter how often somebody asks.
        target = math.floor((time - self._origin) / STEP + _EPSILON)
        while self._steps < target:
            if self._waiting:
                self._apply_waiting()
            if bank.still >= _REST_AFTER:
                self._rest(target)
            else:
                bank.step()
                self._steps += 1

    def drive(self, index: int, drive: ShaftDrive) -> None:
        """Let a servo's registers act, after the joint's latency."""
        if drive == self._drives[index]:
            return
        self._drives[index] = drive
        latency = self.configs[index].latency
        if latency == 0.0 or math.isnan(self._asked):
            self._bank.apply(index, drive)
            return
        self._waiting.append((self._asked + latency, index, drive))
        if len(self._waiting) > 1 and self._waiting[-2][0] > self._waiting[-1][0]:
            self._waiting = deque(sorted(self._waiting, key=lambda entry: entry[0]))

    def state(self, index: int) -> ShaftState:
        """The joint now, between two steps by its speed."""
        bank = self._bank
        speed = float(bank.speed[index])
        angle = float(bank.angle[index])
        return ShaftState(
            angle=angle + speed * (self._asked - self._origin - self._steps * STEP) if speed else angle,
            speed=speed,
            load=float(bank.duty[index]),
            temperature=float(bank.temperature[index]),
            voltage=bank.voltage,
        )

    def torque(self, index: int) -> float:
        """Motor torque now, N·m, after back-EMF and before friction."""
        return float(self._bank.torque[index])

    def set_supply(self, voltage: float) -> None:
        """Change the supply's voltage (V) without load."""
        require_nonnegative(voltage=voltage)
        self._bank.open_voltage = self._bank.voltage = voltage
        self._bank.still = 0

    def set_temperature(self, index: int, temperature: float) -> None:
        """Put a motor to a temperature, °C."""
        require_finite(temperature=temperature)
        self._bank.temperature[index] = temperature

    def turn(self, index: int, angle: float) -> None:
        """Put a joint to an angle (rad), at rest, as a hand would."""
        require_finite(angle=angle)
        self._bank.angle[index] = angle
        self._bank.speed[index] = 0.0
        self._bank.still = 0

    def _apply_waiting(self) -> None:
        """Let those registers act whose latency is over."""
        now = self._origin + self._steps * STEP
        while self._waiting and self._waiting[0][0] <= now + _EPSILON * STEP:
            _, index, drive = self._waiting.popleft()
            self._bank.apply(index, drive)

    def _rest(self, target: int) -> None:
        """All joints stand still and nothing changes, until the step `target` or the next change."""
        if self._waiting:
            change = math.ceil((self._waiting[0][0] - self._origin) / STEP - _EPSILON)
            target = min(target, max(change, self._steps + 1))
        self._bank.rest(target - self._steps)
        self._steps = target
