"""Arguments of ``bluefoot servo``: commissioning of servos."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from bluefoot_mpc.cli.arguments import Common, ModelArguments
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.calibration import DEFAULT_FILE

_Unset = tyro.conf.arg(help_behavior_hint="")


@dataclass(frozen=True, kw_only=True)
class ServoArguments(Common):
    """What every command on servos takes."""

    port: Annotated[tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(metavar="PATH[,PATH...]")] = ()
    """Serial port of the servos; several by commas, or by giving the option more than once."""
    baud: int = 1_000_000
    """Baud rate of the servos."""
    ids: Annotated[str, tyro.conf.arg(metavar="ID,...")] = "1-16"
    """IDs of the servos, for example 1-16 or 1,2,7-9."""
    board: Annotated[str | None, tyro.conf.arg(metavar="PATH", help_behavior_hint="")] = None
    """Serial port of the sensor board, where the servos get their supply through it: on while this runs."""
    board_baud: int = 115_200
    """Baud rate of the sensor board."""


@dataclass(frozen=True, kw_only=True)
class ScanCommand(ServoArguments):
    """Find servos and show what they say about themselves; writes nothing.

    Exit status 3 where one is missing, garbled, or no AX-12A.
    """

    all_bauds: bool = False
    """Look at every standard baud rate."""


@dataclass(frozen=True, kw_only=True)
class SetupCommand(ServoArguments):
    """Write the servos' permanent memory (EEPROM): the only command that does.

    Shows what will change and asks first. With --new-id or --new-baud it changes that alone.
    """

    new_id: Annotated[int | None, _Unset] = None
    """Give the one servo named by --ids this ID; connect no other servo with the same old ID."""
    new_baud: Annotated[int | None, _Unset] = None
    """Bring the servos to this baud rate."""
    return_delay: float = 0.0
    """Pause between request and reply, µs."""
    calibration: Annotated[Path, tyro.conf.arg(metavar="FILE")] = DEFAULT_FILE
    """Calibration that a change of ID makes stale, where the file exists."""
    yes: bool = False
    """Do not ask."""

    def __post_init__(self) -> None:
        if self.new_id is not None and self.new_baud is not None:
            raise ConfigurationError("--new-id and --new-baud: one at a time")


@dataclass(frozen=True, kw_only=True)
class CalibrateCommand(ServoArguments, ModelArguments):
    """Find offsets and signs: pose the limp robot by the drawing, then turn joint by joint by hand.

    With --yes nothing is asked: the robot stands in the pose already, and signs are those of the
    file that --out names (all +1 without one); joints it had not verified stay unverified.
    """

    out: Annotated[Path, tyro.conf.arg(metavar="FILE")] = DEFAULT_FILE
    """File to write."""
    pose: Annotated[str, tyro.conf.arg(metavar="YAW,PITCH,KNEE,ANKLE")] = "0,0,0,0"
    """Angles of every leg in the calibration pose, degrees."""
    joints: Annotated[str, tyro.conf.arg(metavar="JOINT,...", help_behavior_hint="(all)")] = ""
    """Joints to calibrate anew; all others keep what the file says."""
    draw: bool = False
    """Show the pose and the direction of every joint, and do nothing else."""
    yes: bool = False
    """Do not ask."""


@dataclass(frozen=True, kw_only=True)
class ExerciseCommand(ServoArguments):
    """Move one servo after another a little, weak and slow, and see that it follows.

    Exit status 1 where one does not. The robot must hang free. Torque is off at the end.
    """

    amplitude: float = 10.0
    """Degrees, towards the middle of the servo's range."""
    torque_limit: float = 0.4
    """Share of full torque."""
    speed: float = 60.0
    """Degrees per second."""
    yes: bool = False
    """Do not ask whether the robot hangs free."""


@dataclass(frozen=True, kw_only=True)
class IdentifyCommand(ServoArguments, ModelArguments):
    """Step servos in free air, and fit stiffness, friction, rotor inertia and latency to them.

    Writes a configuration that the simulator loads (bluefoot run ... --config), the recorded steps,
    and a picture of measured against fitted steps. Torque is off at the end.
    """

    amplitudes: Annotated[str, tyro.conf.arg(metavar="DEG,...")] = "2,4,8,16,32"
    """Sizes of the steps, degrees; each one up and back, down and back."""
    repeats: int = 1
    """Times the whole pattern."""
    middle: int = 512
    """Count from which the steps start."""
    torque_limit: float = 1.0
    """Share of full torque."""
    load_inertia: float = 0.0
    """Inertia on the shaft besides the rotor, kg·m²."""
    load_moment: float = 0.0
    """Moment of a weight on a level lever on the shaft, N·m."""
    load_angle: float = 0.0
    """Angle at which the weight hangs straight down, degrees from the servo's middle."""
    steps: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """Fit the steps of an earlier identification (its steps.json) again; needs no servo."""
    out: Path = Path("runs/identify")
    """Folder for servo.toml, steps.json and pictures."""
    yes: bool = False
    """Do not ask whether the shafts turn freely."""


ServoCommand = (
    Annotated[ScanCommand, tyro.conf.subcommand("scan")]
    | Annotated[SetupCommand, tyro.conf.subcommand("setup")]
    | Annotated[CalibrateCommand, tyro.conf.subcommand("calibrate")]
    | Annotated[ExerciseCommand, tyro.conf.subcommand("test")]
    | Annotated[IdentifyCommand, tyro.conf.subcommand("identify")]
)
