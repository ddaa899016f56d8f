"""From options, a configuration file and overrides to one resolved configuration."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.names import CONTROLLERS, DEFAULT_CONTROLLER
from bluefoot_mpc.control.presets import preset
from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.io.safety import SafetyConfig
from bluefoot_mpc.io.servo_robot.config import DevicesConfig
from bluefoot_mpc.model.parameters import RobotParameters, load_parameters
from bluefoot_mpc.scenarios.base import Scenario
from bluefoot_mpc.scenarios.options import RunOptions
from bluefoot_mpc.settings import build, merge, parse_override, read_toml, to_table
from bluefoot_mpc.sim.config import SimConfig

SCENARIO_OPTIONS = {
    "duration": "duration", "gait": "gait", "speed": "speed", "lateral_speed": "lateral_speed",
    "yaw_rate": "yaw_rate", "impulse": "impulse", "direction": "direction", "push_time": "push_time",
    "leader": "leader", "blind": "blind",
}  # fmt: skip
"""Options that fill a field of the scenario's configuration, where it has that field."""


@dataclass(frozen=True, kw_only=True, slots=True)
class RunSection:
    """What is run."""

    scenario: str
    seed: int = 0
    robot: str = "sim"
    controller: str = DEFAULT_CONTROLLER


@dataclass(frozen=True, kw_only=True, slots=True)
class StageConfig:
    """Configuration of everything but the scenario and the robot's body."""

    sim: SimConfig = field(default_factory=SimConfig)
    devices: DevicesConfig = field(default_factory=DevicesConfig)
    safety: SafetyConfig = field(default_factory=SafetyConfig)
    control: ControlConfig = field(default_factory=ControlConfig)


@dataclass(frozen=True, kw_only=True, slots=True)
class Resolved:
    """A run's whole configuration, checked.

    Attributes:
        run: what is run.
        scenario: the scenario with its configuration.
        stages: simulator, supervisor and controller.
        parameters: the robot's body.
    """

    run: RunSection
    scenario: Scenario
    stages: StageConfig
    parameters: RobotParameters

    @property
    def command_period(self) -> float:
        """s, between two commands to the robot."""
        simulated = self.run.robot == "sim"
        return self.stages.sim.command_period if simulated else self.stages.devices.period

    def table(self) -> dict[str, Any]:
        """Everything as one nested table, for ``config.toml``, the log and the hash."""
        return {
            "run": to_table(self.run),
            "scenario": to_table(self.scenario.config),
            **to_table(self.stages),
            "model": to_table(self.parameters),
        }


def resolve(scenario: type[Scenario], options: RunOptions) -> Resolved:
    """Put preset, the scenario's own, configuration file, overrides and options together, in rising rank.

    Raises:
        ConfigurationError: a key is unknown, or a value impossible.
    """
    table = read_toml(options.config) if options.config is not None else {}
    for override in options.overrides:
        table = merge(table, parse_override(override))
    controller = _controller(table, options, scenario)
    table = _without_run(table)
    stage_names = [f.name for f in fields(StageConfig)]
    for key, value in table.items():
        if key not in (*stage_names, "scenario", "model"):
            raise UnknownNameError("configuration section", key, (*stage_names, "scenario", "model"))
        if not isinstance(value, Mapping):
            raise ConfigurationError(f"{key} must be a table, not {value!r}")
    parameters = _parameters(table, options)
    scenario_table = merge(table.get("scenario", {}), _scenario_options(scenario, options))
    made = scenario(build(scenario.Config, scenario_table, "scenario"))
    control = merge(to_table(preset(controller, parameters)), _own_control(made, controller))
    table = merge(merge({"control": control}, _surroundings(made)), table)
    table = merge(table, _level_options(table, options))
    table = merge(table, _device_options(options))
    stages = build(StageConfig, {key: table[key] for key in stage_names if key in table})
    sim = build(SimConfig, merge(to_table(stages.sim), _sim_options(options)), "sim")
    made.world = sim.world
    _require_sensors(made, stages.devices, options.robot)
    return Resolved(
        run=RunSection(scenario=scenario.name, seed=options.seed, robot=options.robot, controller=controller),
        scenario=made,
        stages=replace(stages, sim=made.prepare(sim)),
        parameters=parameters,
    )


def _controller(table: dict[str, Any], options: RunOptions, scenario: type[Scenario]) -> str:
    """The controller that is asked for, or the one whose configuration the file holds, or the scenario's."""
    default = scenario.default_controller
    if default not in CONTROLLERS:
        raise ConfigurationError(
            f"scenario '{scenario.name}': default_controller = {default!r} "
            f"must be one of: {', '.join(CONTROLLERS)}"
        )
    run = table.get("run", {})
    named = run.get("controller") if isinstance(run, Mapping) else None
    if named is not None and named not in CONTROLLERS:
        raise UnknownNameError("controller", str(named), CONTROLLERS)
    if None not in (named, options.controller) and named != options.controller and "control" in table:
        if options.config is None:
            raise ConfigurationError(
                f"--set run.controller={named} and --controller {options.controller} differ: leave one out"
            )
        raise ConfigurationError(
            f"{options.config} holds the configuration of the controller '{named}': "
            f"leave --controller {options.controller} out, or take a file without [control]"
        )
    return options.controller or named or default


def _own_control(scenario: Scenario, controller: str) -> Mapping[str, Any]:
    """What the scenario itself changes of the controller's configuration: may be a user's code."""
    changes = scenario.control(controller)
    if not isinstance(changes, Mapping):
        raise ConfigurationError(
            f"scenario '{scenario.name}': control() must return a table (dict) of what it changes, "
            f"{{}} for nothing, not {changes!r}"
        )
    return changes


def _surroundings(scenario: Scenario) -> dict[str, Any]:
    """The world that a scenario runs in where nobody chooses, and the sensors that it uses."""
    sensors = {name: {"enabled": True} for name in scenario.uses}
    table: dict[str, Any] = {"sim": {"world": {"name": scenario.default_world}, **sensors}}
    return table | {"devices": {"emulate_lidar": True}} if "lidar" in sensors else table


def _require_sensors(scenario: Scenario, devices: DevicesConfig, robot: str) -> None:
    """A real robot has the sensors that the scenario needs, or is told of them."""
    ports = {"lidar": ("lidar_port", devices.lidar_port), "camera": ("camera", devices.camera)}
    for sensor in scenario.needs if robot == "hardware" else ():
        key, port = ports[sensor]
        if not port:
            raise ConfigurationError(
                f"scenario '{scenario.name}' needs a {sensor}: say where it is, "
                f"--set devices.{key}={'/dev/ttyACM0' if sensor == 'lidar' else '0'}"
            )


def _without_run(table: dict[str, Any]) -> dict[str, Any]:
    # The config.toml of an earlier run may be given back: what is run comes from
    # the command line, and what was drawn follows from the seed.
    return {key: value for key, value in table.items() if key not in ("run", "drawn")}


def _parameters(table: dict[str, Any], options: RunOptions) -> RobotParameters:
    base = load_parameters(options.model)
    if "model" not in table:
        return base
    return build(RobotParameters, merge(to_table(base), table["model"]), "model")


def _scenario_options(scenario: type[Scenario], options: RunOptions) -> dict[str, Any]:
    known = {f.name for f in fields(scenario.Config)}
    values: dict[str, Any] = {}
    for option, key in SCENARIO_OPTIONS.items():
        value = getattr(options, option)
        if value is None:
            continue
        if key not in known:
            usable = ", ".join(f"--{name.replace('_', '-')}" for name in SCENARIO_OPTIONS if name in known)
            raise ConfigurationError(
                f"scenario '{scenario.name}' has no option --{option.replace('_', '-')}; it takes: {usable}"
            )
        values[key] = value
    return values


def _level_options(table: dict[str, Any], options: RunOptions) -> dict[str, Any]:
    """What the levelling options stand for in the configuration."""
    chosen: dict[str, Any] = {}
    if options.level is not None:
        chosen["enabled"] = options.level != "none"
    if options.level in ("pd", "narx"):
        chosen |= {"attitude": True, "psi": "zero" if options.level == "pd" else "network"}
    if options.level_mix is not None:
        chosen["mix"] = options.level_mix
        if not chosen.get("enabled", table["control"]["leveling"]["enabled"]):
            raise ConfigurationError(
                "--level-mix has no effect without levelling: add --level pd or --level narx"
            )
    return {"control": {"leveling": chosen}} if chosen else {}


def _device_options(options: RunOptions) -> dict[str, Any]:
    given = {"ports": list(options.port), "baud": options.baud, "link": options.link}
    chosen = {key: value for key, value in given.items() if value}
    return {"devices": chosen} if chosen else {}


def _sim_options(options: RunOptions) -> dict[str, Any]:
    world: dict[str, Any] = {}
    if options.world is not None:
        world["name"] = options.world
    if options.friction is not None:
        world["friction"] = options.friction
    if options.slope is not None:
        world["slope_deg"] = options.slope
    if options.payload is not None:
        if options.payload[0] < 0.0 or not math.isfinite(options.payload[0]):
            raise ConfigurationError(f"--payload mass = {options.payload[0]} kg must not be negative")
        world["payload"] = list(options.payload)
    table: dict[str, Any] = {"world": world} if world else {}
    if options.randomize != "none":
        table["randomization"] = {"preset": options.randomize}
    return table
