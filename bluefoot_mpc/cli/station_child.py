"""A robot's program started by the station: ``bluefoot run remote`` in a process of its own."""

from __future__ import annotations

import contextlib
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import IO

from bluefoot_mpc.cli.station_arguments import StationCommand

_VERDICT = re.compile(r"(OK|[A-Z]{4,}[^:]*|bluefoot): ")
_PATIENCE = 15.0
"""s that the robot gets to sit down and write its log."""


class RobotProcess:
    """The robot's program; its output goes into a file.

    Args:
        command: the station's own arguments.
        folder: of the station's run; the robot's lies in it.
    """

    def __init__(self, command: StationCommand, folder: Path) -> None:
        self._folder, self._number = folder, 0
        address = command.address.replace("udpin:", "udp:", 1)
        self._words = [sys.executable, "-m", "bluefoot_mpc.cli", "run", "remote", "--no-report"]
        self._words += ["--robot", command.robot, "--station", address]
        if command.controller is not None:
            self._words += ["--controller", command.controller]
        if command.world is not None:
            self._words += ["--world", command.world]
        for override in command.set:
            self._words += ["--set", override]
        self._process: subprocess.Popen[bytes] | None = None
        self._output: IO[bytes] | None = None
        self.start()

    @property
    def running(self) -> bool:
        """False once it has ended."""
        return self._process is not None and self._process.poll() is None

    @property
    def folder(self) -> Path:
        """Where the newest run of the robot is written."""
        return self._folder / f"robot-{self._number}"

    def start(self) -> None:
        """Start the robot, a further time where the one before has ended."""
        self._number += 1
        self._folder.mkdir(parents=True, exist_ok=True)
        self._close()
        self._output = (self._folder / f"robot-{self._number}.txt").open("wb")
        self._process = subprocess.Popen(
            [*self._words, "--out", str(self.folder)],
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=subprocess.STDOUT,
            # Ctrl-C at the terminal is for the station, which then ends the robot.
            start_new_session=True,
        )

    def last_words(self) -> str:
        """The line in which the robot's program said how it ended."""
        with contextlib.suppress(OSError):
            text = (self._folder / f"robot-{self._number}.txt").read_text("utf-8", "replace")
            verdicts = [line.strip() for line in text.splitlines() if _VERDICT.match(line)]
            return verdicts[-1] if verdicts else ""
        return ""

    def end(self) -> None:
        """Let the robot sit down and end; by force where it does not. Idempotent."""
        process = self._process
        if process is not None and process.poll() is None:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(timeout=_PATIENCE)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._close()

    def _close(self) -> None:
        if self._output is not None:
            self._output.close()
        self._output = None
