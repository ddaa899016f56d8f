"""Entry point of ``bluefoot``: parse, run the command, print its page or its JSON, return the exit status."""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import cast

from rich.console import Console
from rich.text import Text

from bluefoot_mpc.cli import (
    arguments,
    deploy_arguments,
    doctor_arguments,
    emulator_arguments,
    servo_arguments,
    station_arguments,
    validate_arguments,
    world_arguments,
)
from bluefoot_mpc.cli.messages import keep_traceback, messages_on_stderr
from bluefoot_mpc.cli.outcome import FAILED, INTERRUPTED, OK, Outcome, to_json
from bluefoot_mpc.cli.parse import parse
from bluefoot_mpc.exceptions import BlueFootError, ConfigurationError

_EXECUTE: dict[type, str] = {
    arguments.ListCommand: "run:list_scenarios",
    arguments.RunCommand: "run:run",
    arguments.ReplayCommand: "replay:replay",
    arguments.CheckCommand: "model:check",
    arguments.UrdfCommand: "model:urdf",
    arguments.RomCommand: "model:rom",
    arguments.PowerCommand: "model:power",
    arguments.DriveCommand: "drive:drive",
    arguments.BenchCommand: "bench:bench",
    emulator_arguments.EmulatorCommand: "emulator:emulator",
    servo_arguments.ScanCommand: "servo:scan",
    servo_arguments.SetupCommand: "servo:setup",
    servo_arguments.CalibrateCommand: "servo_calibrate:calibrate",
    servo_arguments.ExerciseCommand: "servo_motion:test",
    servo_arguments.IdentifyCommand: "servo_motion:identify",
    doctor_arguments.DoctorCommand: "doctor:doctor",
    station_arguments.StationCommand: "station:station",
    validate_arguments.ValidateCommand: "validate:validate",
    deploy_arguments.DeployCommand: "deploy:deploy",
    world_arguments.WorldCommand: "world:world",
}
"""Command to the function that runs it; imported late, so that ``--help`` is quick."""


class _Page(Console):
    """Standard output; a reader that goes away is left to the caller, not turned into exit status 1."""

    def on_broken_pipe(self) -> None:
        """Raise again."""
        raise BrokenPipeError


def main(argv: Sequence[str] | None = None, prog: str = "bluefoot") -> int:
    """Run one command line and return its exit status (0, 1, 2, 3 or 130; see the help)."""
    words = list(sys.argv[1:] if argv is None else argv)
    as_json, debug = "--json" in words, "--debug" in words
    _make_streams_usable()
    try:
        with messages_on_stderr(debug), _only_json() if as_json else contextlib.nullcontext():
            outcome = _execute(words, prog)
    except SystemExit as stop:  # --help
        return int(stop.code or 0)
    except BrokenPipeError:  # a reader of the help that has seen enough
        return _leave_quietly(OK)
    except BlueFootError as error:
        return _fail(str(error), error.exit_status, as_json, notes(error))
    except KeyboardInterrupt as stop:
        return _fail("interrupted", INTERRUPTED, as_json, notes(stop))
    except Exception as error:
        # The one place that catches everything: a user gets a sentence, the file gets the traceback.
        if debug:
            raise
        evidence = f"the traceback is in {keep_traceback(error)} (--debug shows it)"
        message = f"unexpected {type(error).__name__}: {error}"
        return _fail(message, FAILED, as_json, (*notes(error), evidence))
    status = _show(outcome, as_json)
    return status if outcome.serve is None else _serve(outcome.serve, as_json)


def notes(error: BaseException) -> tuple[str, ...]:
    """What was added to an exception on its way up, such as where the log lies."""
    return tuple(getattr(error, "__notes__", ()))


def _execute(words: Sequence[str], prog: str) -> Outcome:
    command = parse(words, prog)
    module, _, name = _EXECUTE[type(command)].partition(":")
    try:
        function = getattr(importlib.import_module(f"bluefoot_mpc.cli.{module}"), name)
        return cast(Callable[[arguments.Common], Outcome], function)(command)
    except RuntimeError as error:
        if "MUJOCO_GL" not in str(error):
            raise
        # MuJoCo looks at it when it is imported, whether pictures are wanted or not.
        raise ConfigurationError(f"{error}. Unset MUJOCO_GL, or choose egl or osmesa") from error


def _show(outcome: Outcome, as_json: bool) -> int:
    try:
        if as_json:
            print(to_json(outcome.data), flush=True)
        else:
            console = _Page(highlight=False)
            for part in outcome.page:
                # Lines of text stay whole: a path or a URDF that was wrapped is of no use.
                console.print(part, soft_wrap=isinstance(part, (str, Text)), markup=False)
            sys.stdout.flush()
    except BrokenPipeError:  # the reader (head, less) has seen enough
        return _leave_quietly(outcome.status)
    except OSError as error:  # a full disk, say
        _leave_quietly(FAILED)
        return _fail(f"cannot write to standard output: {error.strerror or error}", FAILED, as_json=False)
    return outcome.status


def _serve(serve: Callable[[], None], as_json: bool) -> int:
    """What goes on after the page was shown."""
    try:
        serve()
    except KeyboardInterrupt:
        return OK  # how it is meant to end
    except BlueFootError as error:
        return _fail(str(error), error.exit_status, as_json)
    return OK


def _leave_quietly(status: int) -> int:
    """Exit status, with standard output turned away, so that nothing is flushed into it at the exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    return status


def _make_streams_usable() -> None:
    """Give the process the streams that it was started without, and let no sign be one too many for them."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115 - until the exit
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _fail(message: str, status: int, as_json: bool, remarks: Sequence[str] = ()) -> int:
    text = "\n".join((message.strip(), *remarks))
    console = Console(stderr=True, highlight=False, soft_wrap=True)
    console.print(Text.assemble(("bluefoot: ", "bold red"), text))
    if as_json:
        print(to_json({"error": text, "exit_status": status}), flush=True)
    return status


@contextlib.contextmanager
def _only_json() -> Iterator[None]:
    """Send what anybody else prints, libraries in C included, to standard error."""
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        with contextlib.redirect_stdout(sys.stderr):
            yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
