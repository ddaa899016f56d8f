"""``bluefoot drive``: a person at the keyboard, or a gamepad, commands a robot in real time."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TextIO

from bluefoot_mpc.cli.arguments import DriveCommand
from bluefoot_mpc.cli.gamepad import Gamepad
from bluefoot_mpc.cli.outcome import Outcome
from bluefoot_mpc.cli.run import outcome_of
from bluefoot_mpc.cli.teleop import GAITS, HELP, Teleop, TeleopConfig, TeleopState
from bluefoot_mpc.cli.terminal import Keyboard, raw_terminal
from bluefoot_mpc.scenarios import Presentation, RunOptions, Scenario, ScenarioConfig, run_commanded
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.types import MotionCommand

STATUS_PERIOD = 0.2
"""s between two status lines."""


@dataclass(frozen=True, kw_only=True, slots=True)
class DriveConfig(ScenarioConfig):
    """What a drive can be told."""

    duration: float = 3600.0  # s, at most
    gait: str = "trot"  # to begin with


class Drive(Scenario):
    """A person drives."""

    name = "drive"
    Config = DriveConfig
    config: DriveConfig

    @property
    def uses(self) -> tuple[str, ...]:
        """It wanders by LIDAR. To follow it needs a camera too, which slows a simulator down."""
        return ("lidar",)

    def command(self, time: float) -> MotionCommand:
        """Stand; the commands come from the operator, not from here."""
        return MotionCommand(gait=self.config.gait)

    def window(self) -> tuple[float, float]:
        """All of it: the operator's commands change too often for anything else."""
        return 0.0, self.config.duration


class Session:
    """The operator as a source of commands.

    Args:
        teleop: what keys mean.
        keyboard: where keys come from.
        gamepad: where sticks come from.
        state: the beginning.
        limit: s, when the drive ends by itself.
        screen: where the status line goes.
    """

    def __init__(
        self,
        *,
        teleop: Teleop,
        keyboard: Keyboard,
        gamepad: Gamepad,
        state: TeleopState,
        limit: float,
        screen: TextIO,
    ) -> None:
        self._teleop, self._keyboard, self._gamepad = teleop, keyboard, gamepad
        self._screen, self._limit = screen, limit
        self._state = state
        self._next_status = 0.0

    def __call__(self, time: float) -> MotionCommand | None:
        """The command at `time` (s since the start); None ends the drive."""
        sticks, buttons = self._gamepad.read()
        state = self._teleop.tilt_sticks(self._state, sticks, time)
        for key in (*self._keyboard.read(), *buttons):
            if key == "h":
                self._print(HELP)
            state = self._teleop.press(state, key, time)
        if (self._keyboard.closed or time >= self._limit) and state.ending is None:
            state = self._teleop.press(state, "x", time)
        self._state = state
        if time >= self._next_status:
            self._next_status = time + STATUS_PERIOD
            self._screen.write(f"\r\x1b[K{self._teleop.status(state, time)}")
            self._screen.flush()
        return self._teleop.command(state, time)

    def _print(self, text: str) -> None:
        self._screen.write(f"\r\x1b[K{text}\n")


def drive(command: DriveCommand) -> Outcome:
    """Drive until the operator ends it, then write the log and the report like any run."""
    options = RunOptions(**command.run_fields())
    resolved = resolve(Drive, options)
    teleop = Teleop(TeleopConfig(timeout=command.timeout))
    gamepad = Gamepad(command.gamepad)
    screen = sys.stderr
    with raw_terminal() as descriptor:
        found = gamepad.open()
        screen.write(HELP + "\n")
        screen.write(f"gamepad: {gamepad.name}\n" if found else "no gamepad found: keyboard only\n")
        state = TeleopState(gait=options.gait or GAITS[0])
        session = Session(
            teleop=teleop,
            keyboard=Keyboard(descriptor),
            gamepad=gamepad,
            state=state,
            limit=resolved.scenario.config.duration,
            screen=screen,
        )
        try:
            # The status line stands where a progress bar would.
            result = run_commanded(session, resolved, options, Presentation(paced=True, progress=False))
        finally:
            gamepad.close()
            screen.write("\r\x1b[K")
            screen.flush()
    return outcome_of(result)
