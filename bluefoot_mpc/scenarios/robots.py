"""The robot that a run is for: simulated, emulated, or real."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from bluefoot_mpc.io.pacing import PacedRobot
from bluefoot_mpc.io.robot import PoweredRobot, Robot
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.scenarios.base import Criterion
from bluefoot_mpc.scenarios.config import Resolved
from bluefoot_mpc.sim.body import Posture
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.types import TruthSample


@dataclass(frozen=True, kw_only=True, slots=True)
class RunRobot:
    """A robot, and what a run knows of it beside its frames.

    Attributes:
        robot: the robot, not yet behind its supervisor.
        truth: the simulator's truth at the last frame, for the record; None where there is no simulator.
        drawn: what randomisation made of this run.
        devices: what emulated devices saw of their driver, for the summary; None where they are not emulated.
        parts: the emulated devices, for tests; None elsewhere.
    """

    robot: Robot
    truth: Callable[[], TruthSample] | None = None
    drawn: dict[str, Any] = field(default_factory=dict)
    devices: Callable[[], dict[str, Any]] | None = None
    parts: Any = None

    @property
    def rests(self) -> bool:
        """Whether the robot must sit down before a run may end."""
        return isinstance(self.robot, PoweredRobot)


def make_robot(resolved: Resolved, model: RobotModel, sitting: Posture, paced: bool = False) -> RunRobot:
    """The robot that a run asks for.

    Args:
        resolved: the run's configuration.
        model: the robot's model.
        sitting: how an emulated robot is found at the start, and a powered one sinks to by itself.
        paced: a second of the run takes a second at least.

    Raises:
        ConfigurationError: the configuration lacks what the robot needs, a port say.
        DeviceError: a device cannot be reached.
    """
    if resolved.run.robot == "sim":
        simulator = SimRobot(model, resolved.stages.sim, resolved.run.seed)
        robot = PacedRobot(simulator) if paced else simulator
        return RunRobot(robot=robot, truth=simulator.truth, drawn=simulator.drawn)
    # Serial ports and emulators are of no use to a simulated run.
    if resolved.run.robot == "hardware":
        from bluefoot_mpc.scenarios.hardware import make_hardware  # noqa: PLC0415

        return make_hardware(resolved, model)
    if resolved.stages.devices.link == "pty":
        from bluefoot_mpc.scenarios.emulated_live import make_emulated_live  # noqa: PLC0415

        return make_emulated_live(resolved, model, sitting)
    from bluefoot_mpc.scenarios.emulated import make_emulated  # noqa: PLC0415

    return make_emulated(resolved, model, sitting, paced)


def device_criteria(seen: Mapping[str, Any] | None) -> list[Criterion]:
    """What emulated devices must have seen of their driver; nothing to say where there are none."""
    if seen is None:
        return []
    # In real time each program is paused now and then: a reply that was given up meets the next request.
    excused = ("collision", "overlap") if seen.get("in_real_time") else ()
    violations = {
        kind: count for kind, count in seen["protocol_violations"].items() if count and kind not in excused
    }
    told = ", ".join(f"{kind} {count}" for kind, count in violations.items())
    on = seen["torque_on"]
    return [
        Criterion(name="no violation of the bus protocol", holds=not violations, detail=told or "none"),
        Criterion(
            name="no write to a servo's permanent memory", holds=not seen["eeprom_writes"],
            detail=str(seen["eeprom_writes"]),
        ),
        Criterion(
            name="every torque off at the end", holds=not on,
            detail=f"on: servos {', '.join(map(str, on))}" if on else "off",
        ),
        Criterion(
            name="servos' supply off at the end", holds=not seen["power_on"],
            detail="on" if seen["power_on"] else "off",
        ),
    ]  # fmt: skip
