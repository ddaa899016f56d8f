"""Safety: the supervisor around every robot, and the watchdogs above, below and beside it."""

from bluefoot_mpc.io.safety.commands import CommandWatchdog, CommandWatchdogConfig
from bluefoot_mpc.io.safety.config import SafetyConfig
from bluefoot_mpc.io.safety.guard import Guard, GuardAction, GuardConfig, GuardState
from bluefoot_mpc.io.safety.health import Health, Watched
from bluefoot_mpc.io.safety.states import SafetyState
from bluefoot_mpc.io.safety.supervisor import ArmingInterruptedError, SafetySupervisor

__all__ = [
    "ArmingInterruptedError",
    "CommandWatchdog",
    "CommandWatchdogConfig",
    "Guard",
    "GuardAction",
    "GuardConfig",
    "GuardState",
    "Health",
    "SafetyConfig",
    "SafetyState",
    "SafetySupervisor",
    "Watched",
]
