"""The cycle of all servos: one sync write, sixteen positions, one full reading in turn; fifty times a second.

Lost replies are values, not exceptions: a reading has a time and says whether
it is fresh. A servo that stays silent is left out, asked soon and then once a second, so
that it does not slow the others. One that was gone is looked at before it gets
another goal, for a goal switches torque on: when it has lost its RAM, goals are
withheld until it is armed again.
"""

from __future__ import annotations

import select
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.dynamixel.bus import ServoBus
from bluefoot_mpc.io.dynamixel.errors import CommandRangeError
from bluefoot_mpc.io.dynamixel.layout import ServoLayout
from bluefoot_mpc.io.dynamixel.port_cycle import CycleConfig, PortCycle
from bluefoot_mpc.io.dynamixel.replies import Outcome
from bluefoot_mpc.io.dynamixel.servo_state import ServoState
from bluefoot_mpc.io.dynamixel.table import AX12A
from bluefoot_mpc.io.link import LinkLostError
from bluefoot_mpc.types import N_JOINTS, BoolArray, FloatArray

__all__ = ["BusCycle", "CycleConfig", "Readings"]

_PAST = 0.0
_HIGHEST_GOAL = AX12A["goal_position"].high
_HIGHEST_SPEED = 1023  # of joint mode; beyond is wheel mode's direction bit
_HIGHEST_LIMIT = AX12A["torque_limit"].high


@dataclass(frozen=True, kw_only=True, slots=True)
class Readings:
    """What the servos measured, as measured; the newest values, whatever their age.

    Attributes:
        counts: (16,) position counts; NaN where there never was one.
        times: (16,) s, when each servo measured its position.
        fresh: (16,) True where that was in this cycle.
        put_off: (16,) True where this cycle had no time to ask; those servos are asked first in the next.
        speed: (16,) rad/s, counter-clockwise positive.
        load: (16,) fraction of full duty, counter-clockwise positive.
        voltage: (16,) V.
        temperature: (16,) °C.
        full_times: (16,) s, when each servo measured speed, load, voltage and temperature.
        errors: (16,) error bits (`ErrorBit`) of each servo's newest reply.
        suspects: (16,) True where a servo is left out and asked now and then.
        returned: (16,) True where a servo lost its RAM: it is limp, and gets no goal until it is armed.
        shut: (16,) True where a servo reported overheating or overload since it was armed.
        lost_ports: names of ports that are gone.
    """

    counts: FloatArray
    times: FloatArray
    fresh: BoolArray
    put_off: BoolArray
    speed: FloatArray
    load: FloatArray
    voltage: FloatArray
    temperature: FloatArray
    full_times: FloatArray
    errors: NDArray[np.int64]
    suspects: BoolArray
    returned: BoolArray
    shut: BoolArray
    lost_ports: tuple[str, ...]


class BusCycle:
    """The servos of a robot on one or several ports. One thread owns it.

    Args:
        buses: the ports, in the order of the layout's indices; they share one latch.
        layout: which servo drives which joint.
        clock: that of the links.
        config: limits.

    Raises:
        ConfigurationError: the layout names ports that are not there.
    """

    def __init__(
        self, buses: Sequence[ServoBus], layout: ServoLayout, clock: Clock, config: CycleConfig | None = None
    ) -> None:
        if layout.n_ports > len(buses):
            raise ConfigurationError(f"the layout needs {layout.n_ports} ports, {len(buses)} are given")
        self._clock = clock
        self._latches = [bus.latch for bus in buses]
        self._servos = [ServoState(layout.ids[i], i, layout.part(i)) for i in range(N_JOINTS)]
        config = config or CycleConfig()
        self._ports = [
            PortCycle(bus, [self._servos[joint] for joint in layout.joints(index)], config)
            for index, bus in enumerate(buses)
        ]
        # Ports of the machine can be waited on together; emulated ones share a clock that waiting moves.
        self._can_select = all(hasattr(bus.link, "fileno") for bus in buses)

    @property
    def takes_goals(self) -> BoolArray:
        """(16,) True where a goal would be sent: armed, answering, nothing lost."""
        return np.array([servo.takes_goals for servo in self._servos])

    def admit(self, joints: Iterable[int] | None = None) -> None:
        """Let goals go out to servos that have just been armed; to all where no joints are given."""
        for joint in range(N_JOINTS) if joints is None else joints:
            self._servos[joint].admit()

    def withhold(self, joints: Iterable[int] | None = None) -> None:
        """Send no goals any more, as before arming; to none of the servos where no joints are given."""
        for joint in range(N_JOINTS) if joints is None else joints:
            self._servos[joint].admitted = False

    def write(self, goal: FloatArray, speed: FloatArray, torque_limit: FloatArray | None = None) -> bool:
        """Send goals and speeds, and torque limits where they have changed; does not wait for the line.

        Servos that are not armed, do not answer or have lost their RAM are
        left out.

        Args:
            goal: (16,) counts, 0..1023.
            speed: (16,) counts, 0..1023, 0 = unlimited.
            torque_limit: (16,) counts, 0..1023; None leaves them as they are.

        Returns:
            False where nothing went out: latched, nothing armed, or the port is gone.

        Raises:
            CommandRangeError: a value is not finite or fits no register; nothing was sent.
        """
        if any(latch.closed for latch in self._latches):
            return False
        goals = _registers("goal", goal, _HIGHEST_GOAL)
        speeds = _registers("speed", speed, _HIGHEST_SPEED)
        limits = None if torque_limit is None else _registers("torque limit", torque_limit, _HIGHEST_LIMIT)
        sent = [port.write(goals, speeds, limits) for port in self._ports]
        return any(sent)

    def read(self, deadline: float) -> Readings:
        """Read all positions and one full reading a port.

        Args:
            deadline: s; no request is begun that would not be answered by then. Servos that are not asked
                any more are asked first in the next cycle.
        """
        for port in self._ports:
            port.open()
        active = [port for port in self._ports if self._start(port, deadline)]
        while active:
            if len(active) == 1:
                port = active[0]
                active = [port] if self._advance(port, port.wire.deadline, deadline) else []
            else:
                active = self._advance_all(active, deadline)
        return self._readings()

    def _start(self, port: PortCycle, deadline: float) -> bool:
        try:
            return port.start_next(deadline)
        except LinkLostError as error:
            port.lose(error)
            return False

    def _advance(self, port: PortCycle, until: float, deadline: float) -> bool:
        """Wait for a port's reply until `until` at most, then send its next request; False at its end."""
        try:
            outcome = port.wire.poll(until)
            if outcome is Outcome.WAITING:
                return True
            port.finish(outcome, deadline)
            return port.start_next(deadline)
        except LinkLostError as error:
            port.lose(error)
            return False

    def _advance_all(self, active: list[PortCycle], deadline: float) -> list[PortCycle]:
        """Wait for whichever port answers first."""
        first = min(port.wire.deadline for port in active)
        if self._can_select:
            try:
                files = [port.bus.link.fileno() for port in active]  # type: ignore[attr-defined]
                select.select(files, (), (), max(0.0, first - self._clock.now()))
            except (LinkLostError, OSError, ValueError):
                pass  # a port is gone: the polls below find out which
            return [port for port in active if self._advance(port, _PAST, deadline)]
        moved = [(port, port.wire.asked_at) for port in active]
        active = [port for port in active if self._advance(port, _PAST, deadline)]
        still = [port for port, asked in moved if port in active and port.wire.asked_at == asked]
        if still and len(still) == len(moved):
            slowest = min(still, key=lambda port: port.wire.deadline)
            if not self._advance(slowest, slowest.wire.deadline, deadline):
                active.remove(slowest)
        return active

    def _readings(self) -> Readings:
        servos = self._servos
        return Readings(
            counts=np.array([servo.counts for servo in servos], dtype=float),
            times=np.array([servo.time for servo in servos], dtype=float),
            fresh=np.array([servo.fresh for servo in servos]),
            put_off=np.array([servo.put_off for servo in servos]),
            speed=np.array([servo.speed for servo in servos], dtype=float),
            load=np.array([servo.load for servo in servos], dtype=float),
            voltage=np.array([servo.voltage for servo in servos], dtype=float),
            temperature=np.array([servo.temperature for servo in servos], dtype=float),
            full_times=np.array([servo.full_time for servo in servos], dtype=float),
            errors=np.array([servo.error for servo in servos]),
            suspects=np.array([servo.suspect for servo in servos]),
            returned=np.array([servo.returned for servo in servos]),
            shut=np.array([servo.shut for servo in servos]),
            lost_ports=tuple(port.bus.name for port in self._ports if port.is_lost),
        )


def _registers(name: str, values: FloatArray, highest: int) -> list[int]:
    """(16,) values as whole counts.

    Raises:
        CommandRangeError: one of them is not finite, or outside 0..highest.
    """
    listed: list[float] = values.tolist()
    for joint, value in enumerate(listed):
        if not -0.5 <= value < highest + 0.5:  # false for NaN as well
            raise CommandRangeError(
                f"{name} of joint {joint} is {value!r}: it must lie in 0..{highest} counts. Nothing was sent"
            )
    return [int(value + 0.5) for value in listed]
