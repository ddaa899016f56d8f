"""From words on a command line to one of the command dataclasses, or one clear complaint."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import re
from collections.abc import Sequence
from importlib.metadata import version
from typing import Any, cast

import tyro

from bluefoot_mpc.cli import arguments, commands
from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError

COMMANDS: dict[str, tuple[str, ...]] = {
    "list": (),
    "run": (),
    "replay": (),
    "model": ("check", "urdf", "rom", "power"),
    "world": (),
    "drive": (),
    "bench": (),
    "emulator": (),
    "servo": ("scan", "setup", "calibrate", "test", "identify"),
    "doctor": (),
    "station": (),
    "validate": (),
    "deploy": (),
}
"""Commands, and the words that must follow them."""

_DESCRIPTION = (
    "The BlueFoot quadruped: simulate, walk, replay, drive, compare. "
    "'bluefoot COMMAND --help' lists a command's options, 'bluefoot --version' tells the version.\n\n"
    "Exit status: 0 all is well, 1 a criterion does not hold, 2 wrong use, 3 the device refused, "
    "130 interrupted."
)
_MARKERS = (
    tyro.conf.FlagCreatePairsOff,
    tyro.conf.OmitArgPrefixes,
    tyro.conf.OmitSubcommandPrefixes,
    tyro.conf.DisallowNone,
)
_BOX = "│╭╮╰╯─"
_WRONG_TYPE = re.compile(
    r"Error parsing (\S+): no type matching (\S+) could be instantiated from \[(.*?)\]\."
)
_WRONG_INT = re.compile(r"Error parsing (\S+): invalid literal for int\(\) with base 10: (.+)")
_KINDS = {"FLOAT": "a number", "INT": "a whole number"}


class UsageError(ConfigurationError):
    """The command line cannot be understood; the message says what was expected."""


def parse(argv: Sequence[str], prog: str = "bluefoot") -> arguments.Common:
    """Parse a command line.

    Args:
        argv: words after the program's name.
        prog: the program's name in messages.

    Raises:
        UsageError: a value is missing or has the wrong form.
        UnknownNameError: a command or an option does not exist.
        SystemExit: help or the version was asked for and printed (status 0).
    """
    _check_command(argv)
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            parsed = tyro.cli(
                cast(type[arguments.Common], commands.Command),
                prog=prog,
                description=_DESCRIPTION,
                args=list(argv),
                config=_MARKERS,
                return_unknown_args=True,
            )
    except SystemExit as stop:
        if stop.code in (0, None):
            raise
        raise UsageError(_sentence(complaint.getvalue())) from None
    command, unknown = parsed
    if unknown:
        _reject(command, unknown)
    return command


def option_names(command: Any) -> list[str]:
    """Options of a command as one types them, ``--help`` included."""
    positional = {"scenario", "log", "config_file"}
    names = [f.name for f in dataclasses.fields(command) if f.name not in positional]
    return ["--help", *(f"--{name.replace('_', '-')}" for name in names)]


def _check_command(argv: Sequence[str]) -> None:
    words = list(argv)
    if not words:
        raise UsageError(f"a command is missing. Valid: {', '.join(COMMANDS)} (see: bluefoot --help)")
    if words[0] == "--version":
        print(f"bluefoot {version('bluefoot-mpc')}")
        raise SystemExit(0)
    if words[0] in ("-h", "--help"):
        return
    if words[0].startswith("-"):
        raise UsageError(
            f"{words[0]} stands before the command; options follow it: bluefoot COMMAND {words[0]}. "
            f"Valid commands: {', '.join(COMMANDS)}"
        )
    if words[0] not in COMMANDS:
        raise UnknownNameError("command", words[0], COMMANDS)
    inner = COMMANDS[words[0]]
    if inner and (len(words) < 2 or (words[1] not in inner and words[1] not in ("-h", "--help"))):
        if len(words) < 2:
            raise UsageError(f"'bluefoot {words[0]}' needs one of: {', '.join(inner)}")
        raise UnknownNameError(f"'bluefoot {words[0]}' command", words[1], inner)


def _reject(command: Any, unknown: Sequence[str]) -> None:
    options = [word for word in unknown if word.startswith("-")]
    if options:
        raise UnknownNameError("option", options[0].partition("=")[0], option_names(command))
    raise UsageError(f"unexpected argument '{unknown[0]}' (see: --help)")


def _sentence(complaint: str) -> str:
    """Tyro's framed message (a title, what is wrong, help on the argument) as one sentence."""
    lines = [line.strip(_BOX + " ") for line in complaint.splitlines()]
    text = " ".join(line for line in lines[1:] if line)
    text = re.split(r" ?(?:Argument helptext:|For full helptext)", text)[0]
    if match := _WRONG_TYPE.match(text):
        option, kind, value = match.groups()
        return f"{option} = {value} is not {_KINDS.get(kind, f'of the form {kind}')}"
    if match := _WRONG_INT.match(text):
        return f"{match[1]} = {match[2]} is not a whole number"
    return f"{text} (see: --help)"
