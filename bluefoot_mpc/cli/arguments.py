"""Arguments of every command: one dataclass each, its docstrings are the help texts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from bluefoot_mpc.control.names import DEFAULT_CONTROLLER
from bluefoot_mpc.exceptions import ConfigurationError

MAX_STATES = 1_000_000
"""A million states take minutes; nobody learns from more."""
MAX_BENCH_SEEDS = 1000
_Unset = tyro.conf.arg(help_behavior_hint="")  # None means: as the scenario has it


@dataclass(frozen=True, kw_only=True)
class Common:
    """What every command takes."""

    json: bool = False
    """Print one JSON object on standard output and nothing else."""
    debug: bool = False
    """Show the traceback of an unexpected error."""


@dataclass(frozen=True, kw_only=True)
class ListCommand(Common):
    """List the scenarios with one line each."""


@dataclass(frozen=True, kw_only=True)
class SimulationArguments(Common):
    """What every simulated run takes."""

    model: Annotated[str | None, _Unset] = None
    """Parameter file of the robot (TOML), or the name of one that ships."""
    seed: int = 0
    """Seed of everything random; the same seed gives the same run."""
    out: Annotated[Path | None, _Unset] = None
    """Folder for the results (runs/<time>-<scenario> unless given)."""
    config: Annotated[Path | None, _Unset] = None
    """TOML file with any part of the configuration, as in a run's config.toml."""
    set: Annotated[
        tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(metavar="SECTION.KEY=VALUE")
    ] = ()
    """One value of the configuration."""
    randomize: Annotated[str, tyro.conf.arg(metavar="{none,standard}")] = "none"
    """Draw mass, friction, servo gain, voltage and latency from the seed, or not."""
    no_report: bool = False
    """Do not write report.html."""
    world: Annotated[str | None, _Unset] = None
    """World by name (flat, rough, slope, steps, room, corridors, chairs, maze, dead_ends, hidden, arena,
    rubble, random_steps, ramp, kerb, gap, stones), a plan's file (.toml; see: bluefoot world), or an MJCF
    file."""
    friction: Annotated[float | None, _Unset] = None
    """Friction coefficient of the floor."""
    slope: Annotated[float | None, _Unset] = None
    """Slope of the floor, degrees; positive climbs."""
    payload: Annotated[str | None, tyro.conf.arg(metavar="KG,X,Y,Z", help_behavior_hint="")] = None
    """Mass on the trunk and its place in the trunk's frame, kg and m."""
    gait: Annotated[str | None, tyro.conf.arg(metavar="{trot,walk}", help_behavior_hint="")] = None
    """Gait to walk with."""

    def run_fields(self) -> dict[str, Any]:
        """Arguments by the names that RunOptions gives them."""
        names = ("model", "seed", "out", "config", "randomize", "world", "friction", "slope", "gait")
        fields = {name: getattr(self, name) for name in names}
        payload = None if self.payload is None else parse_payload(self.payload)
        return {**fields, "overrides": self.set, "report": not self.no_report, "payload": payload}


@dataclass(frozen=True, kw_only=True)
class RobotArguments(SimulationArguments):
    """What every run on some robot takes."""

    robot: Annotated[str, tyro.conf.arg(metavar="{sim,emulator,hardware}")] = "sim"
    """What to run on: the simulator, emulated devices with the simulator behind them, or the robot."""
    port: Annotated[
        tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(metavar="PATH", help_behavior_hint="")
    ] = ()
    """Hardware: serial port of the servos; again for each further one."""
    baud: Annotated[int | None, tyro.conf.arg(help_behavior_hint="(default: 1000000)")] = None
    """Hardware: rate of the servos' bus, bit/s."""
    link: Annotated[
        str | None, tyro.conf.arg(metavar="{memory,pty}", help_behavior_hint="(default: memory)")
    ] = None
    """Emulator: in memory on a virtual clock, or over pseudo-terminals in real time."""
    station: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS", help_behavior_hint="")] = None
    """Address of a ground station, e.g. udp:127.0.0.1:14550 or serial:/dev/ttyUSB1:57600."""
    controller: Annotated[
        str | None,
        tyro.conf.arg(metavar="{cpg,mpc}", help_behavior_hint=f"(default: {DEFAULT_CONTROLLER}; level: cpg)"),
    ] = None
    """What decides."""

    def run_fields(self) -> dict[str, Any]:
        """Arguments by the names that RunOptions gives them."""
        names = ("robot", "port", "baud", "link", "station", "controller")
        return {**super().run_fields(), **{name: getattr(self, name) for name in names}}


@dataclass(frozen=True, kw_only=True)
class RunCommand(RobotArguments):
    """Run a scenario and write its log, summary and report."""

    scenario: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="SCENARIO", help_behavior_hint="")]
    """Name of a scenario (see: bluefoot list), or path of a scenario script."""
    duration: Annotated[float | None, _Unset] = None
    """Length of the run, s."""
    view: bool = False
    """Show the robot live in a browser."""
    speed: Annotated[float | None, _Unset] = None
    """Forward speed, m/s."""
    lateral_speed: Annotated[float | None, _Unset] = None
    """Speed to the left, m/s."""
    yaw_rate: Annotated[float | None, _Unset] = None
    """Turning to the left, rad/s."""
    impulse: Annotated[float | None, _Unset] = None
    """Push: impulse on the trunk, N·s."""
    direction: Annotated[float | None, _Unset] = None
    """Push: direction from forward, degrees, left positive."""
    push_time: Annotated[float | None, _Unset] = None
    """Push: time after the start, s."""
    leader: Annotated[
        str | None, tyro.conf.arg(metavar="KIND", help_behavior_hint="(default: differential)")
    ] = None
    """Follow: kind of wheeled robot that leads, e.g. ackermann, mecanum, balancing."""
    blind: bool = False
    """Rough: walk straight on at one step height, without looking."""
    level: Annotated[
        str | None,
        tyro.conf.arg(metavar="{none,pd,narx}", help_behavior_hint="(default: none; level: narx)"),
    ] = None
    """Trunk levelling: none, attitude feedback, or with the disturbance that a network predicts
    (options outrank --set)."""
    level_mix: Annotated[float | None, _Unset] = None
    """Trunk levelling: share of its goals in the goals, between 0 and 1 (0.25 unless given)."""

    def run_fields(self) -> dict[str, Any]:
        """Arguments by the names that RunOptions gives them."""
        names = ["duration", "view", "speed", "lateral_speed"]
        names += ["yaw_rate", "impulse", "direction", "push_time", "leader", "level", "level_mix"]
        fields = {**super().run_fields(), **{name: getattr(self, name) for name in names}}
        return {**fields, "blind": self.blind or None}


@dataclass(frozen=True, kw_only=True)
class ReplayCommand(Common):
    """Show a recorded run, or run today's controller on its sensor frames.

    A log that is cut off is shown as far as it goes; the exit status is then 2.
    """

    log: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="LOG", help_behavior_hint="")]
    """The log.mcap of a run, or the run's folder."""
    view: bool = False
    """Play the run in a browser, at its own pace, until Ctrl-C."""
    html: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """Write the 3D replay as one HTML file that opens offline."""
    rethink: bool = False
    """Give the recorded frames to today's controller; exit status 1 where its commands differ."""


@dataclass(frozen=True, kw_only=True)
class ModelArguments(Common):
    """What every command on the model takes."""

    model: Annotated[str | None, _Unset] = None
    """Parameter file of the robot (TOML), or the name of one that ships."""


@dataclass(frozen=True, kw_only=True)
class CheckCommand(ModelArguments):
    """Compare Pinocchio and MuJoCo on the same robot at random states."""

    states: int = 1000
    """Number of random states."""
    seed: int = 0
    """Seed of the states."""

    def __post_init__(self) -> None:
        if not 1 <= self.states <= MAX_STATES:
            raise ConfigurationError(f"--states = {self.states} must lie in 1..{MAX_STATES}")
        if self.seed < 0:
            raise ConfigurationError(f"--seed = {self.seed} must not be negative")


@dataclass(frozen=True, kw_only=True)
class UrdfCommand(ModelArguments):
    """Write the robot's URDF, generated from its parameter file."""

    out: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """File to write (standard output unless given)."""
    check: bool = False
    """Write nothing; exit status 1 where the file that ships beside the parameter file is out of date."""


@dataclass(frozen=True, kw_only=True)
class RomCommand(ModelArguments):
    """Range of motion of legs and trunk: figures and pictures."""

    out: Path = Path("runs/rom")
    """Folder for the pictures."""


@dataclass(frozen=True, kw_only=True)
class PowerCommand(ModelArguments):
    """Power budget and run-times on one charge, or what a recorded run drew."""

    log: Annotated[Path | None, tyro.conf.arg(metavar="LOG", help_behavior_hint="")] = None
    """The log.mcap of a simulated run, or the run's folder: integrate what its servos drew."""


@dataclass(frozen=True, kw_only=True)
class DriveCommand(RobotArguments):
    """Drive a robot from the keyboard, or a gamepad."""

    no_view: bool = False
    """Do not show the robot in a browser."""
    timeout: float = 5.0
    """Dead man: seconds without a key until the robot stops walking."""
    gamepad: Path = Path("/dev/input/js0")
    """Device of the gamepad; used where there is one."""

    def __post_init__(self) -> None:
        if not 0.0 < self.timeout <= 600.0:
            raise ConfigurationError(f"--timeout = {self.timeout} must lie in 0..600 seconds, 0 excluded")

    def run_fields(self) -> dict[str, Any]:
        """Arguments by the names that RunOptions gives them."""
        return {**super().run_fields(), "view": not self.no_view}


@dataclass(frozen=True, kw_only=True)
class BenchCommand(Common):
    """Compare the controllers, and the parts of trunk levelling, over seeds.

    Parts: an ablation of the controllers, the time of every layer, the limit of pushes, and an
    ablation of trunk levelling. Runs are kept in the output folder; a bench that was stopped goes
    on where it stopped. Exit status 1 where the full controller, or levelling, misses a stated limit.
    """

    parts: Annotated[str, tyro.conf.arg(metavar="PART,...")] = "ablation,timing"
    """What to measure: ablation, timing, pushes, level."""
    cases: Annotated[str | None, tyro.conf.arg(metavar="CASE,...", help_behavior_hint="")] = None
    """Cases of ablation and level, or all (some of each unless given; a wrong one lists them)."""
    variants: Annotated[str, tyro.conf.arg(metavar="VARIANT,...", help_behavior_hint="")] = ""
    """Rows of the tables (all unless given): of the ablation, the others are compared with the first;
    of level, with pd and persistence."""
    seeds: int = 5
    """Runs of every case, from seed 0; in most of them the robot is drawn from the seed."""
    duration: Annotated[float | None, _Unset] = None
    """Length of the runs, s (each case's own unless given)."""
    full: bool = False
    """Everything: all cases over 20 seeds, all parts (hours)."""
    workers: Annotated[int | None, _Unset] = None
    """Processes for the runs (one per core unless given)."""
    out: Path = Path("runs/bench")
    """Folder for bench.json, bench.html and the results of the runs."""

    def __post_init__(self) -> None:
        if not 1 <= self.seeds <= MAX_BENCH_SEEDS:
            raise ConfigurationError(f"--seeds = {self.seeds} must lie in 1..{MAX_BENCH_SEEDS}")
        if self.duration is not None and not 5.0 <= self.duration <= 600.0:
            raise ConfigurationError(f"--duration = {self.duration:g} must lie in 5..600 seconds")
        if self.workers is not None and self.workers < 1:
            raise ConfigurationError(f"--workers = {self.workers} must be at least 1")


def parse_payload(text: str) -> tuple[float, float, float, float]:
    """(kg, x, y, z) from ``KG,X,Y,Z``.

    Raises:
        ConfigurationError: the text has another form.
    """
    parts = text.split(",")
    try:
        mass, x, y, z = (float(part) for part in parts)
    except ValueError:
        raise ConfigurationError(
            f"--payload = '{text}' is not of the form KG,X,Y,Z, for example 0.3,0.02,0,0.05"
        ) from None
    return mass, x, y, z
