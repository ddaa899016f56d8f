"""Every command by the word that a person types; families of commands have argument modules of their own."""

from __future__ import annotations

from typing import Annotated

import tyro

from bluefoot_mpc.cli.arguments import (
    BenchCommand,
    CheckCommand,
    DriveCommand,
    ListCommand,
    PowerCommand,
    ReplayCommand,
    RomCommand,
    RunCommand,
    UrdfCommand,
)
from bluefoot_mpc.cli.deploy_arguments import DeployCommand
from bluefoot_mpc.cli.doctor_arguments import DoctorCommand
from bluefoot_mpc.cli.emulator_arguments import EmulatorCommand
from bluefoot_mpc.cli.servo_arguments import ServoCommand
from bluefoot_mpc.cli.station_arguments import StationCommand
from bluefoot_mpc.cli.validate_arguments import ValidateCommand
from bluefoot_mpc.cli.world_arguments import WorldCommand

ModelCommand = (
    Annotated[CheckCommand, tyro.conf.subcommand("check")]
    | Annotated[UrdfCommand, tyro.conf.subcommand("urdf")]
    | Annotated[RomCommand, tyro.conf.subcommand("rom")]
    | Annotated[PowerCommand, tyro.conf.subcommand("power")]
)
Command = (
    Annotated[ListCommand, tyro.conf.subcommand("list")]
    | Annotated[RunCommand, tyro.conf.subcommand("run")]
    | Annotated[ReplayCommand, tyro.conf.subcommand("replay")]
    | Annotated[
        ModelCommand, tyro.conf.subcommand("model", description="Check and export the robot's model.")
    ]
    | Annotated[WorldCommand, tyro.conf.subcommand("world")]
    | Annotated[DriveCommand, tyro.conf.subcommand("drive")]
    | Annotated[BenchCommand, tyro.conf.subcommand("bench")]
    | Annotated[EmulatorCommand, tyro.conf.subcommand("emulator")]
    | Annotated[
        ServoCommand,
        tyro.conf.subcommand("servo", description="Find, set up, calibrate, test and identify servos."),
    ]
    | Annotated[DoctorCommand, tyro.conf.subcommand("doctor")]
    | Annotated[StationCommand, tyro.conf.subcommand("station")]
    | Annotated[ValidateCommand, tyro.conf.subcommand("validate")]
    | Annotated[DeployCommand, tyro.conf.subcommand("deploy")]
)
