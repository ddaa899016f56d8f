"""The C compiler: which one, what it is, and one build with it."""

from __future__ import annotations

import functools
import os
import shlex
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from bluefoot_mpc.codegen.config import CodegenConfig

_CANDIDATES = ("cc", "gcc", "clang")
_IDENTITY_TIMEOUT = 20.0  # s
_MESSAGE_LENGTH = 400


class CodegenUnavailable(Exception):
    """Why a function stays with the virtual machine; never leaves this package."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Compiler:
    """A C compiler that answers.

    Attributes:
        command: program and words that always follow it.
        identity: what it says of itself: name, version, target.
    """

    command: tuple[str, ...]
    identity: str


def find_compiler(config: CodegenConfig) -> Compiler:
    """The compiler that the configuration, ``$CC`` or the search path names.

    Raises:
        CodegenUnavailable: there is none, or it does not answer.
    """
    named = config.compiler or os.environ.get("CC", "")
    try:
        candidates = [tuple(shlex.split(named))] if named.strip() else [(name,) for name in _CANDIDATES]
    except ValueError as error:
        raise CodegenUnavailable(f"cannot read the compiler command {named!r}: {error}") from error
    for words in candidates:
        path = shutil.which(words[0])
        if path is not None:
            return Compiler(command=words, identity=_identity(path, words[1:], os.stat(path).st_mtime_ns))
    sought = ", ".join(words[0] for words in candidates)
    raise CodegenUnavailable(f"no C compiler ({sought} not found; install gcc or set CC)")


def build(compiler: Compiler, source: str, flags: tuple[str, ...], target: Path, timeout: float) -> None:
    """Build a shared library from C text.

    The text goes through standard input, so that no name of a temporary file gets into the result.

    Raises:
        CodegenUnavailable: the compiler fails, or takes longer than `timeout` s.
    """
    command = [*compiler.command, *flags, "-x", "c", "-", "-o", str(target), "-lm"]
    try:
        done = subprocess.run(
            command, input=source, capture_output=True, text=True, timeout=timeout, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise CodegenUnavailable(f"{compiler.command[0]} did not build: {error}") from error
    if done.returncode != 0:
        message = done.stderr.strip()[:_MESSAGE_LENGTH] or f"exit status {done.returncode}"
        raise CodegenUnavailable(f"{compiler.command[0]} failed: {message}")


@functools.cache
def _identity(path: str, words: tuple[str, ...], changed: int) -> str:
    """Version text and target of the program at `path`; `changed` renews what is remembered."""
    del changed
    lines = [" ".join((path, *words))]
    for question in ("--version", "-dumpmachine"):
        try:
            done = subprocess.run(
                [path, *words, question],
                capture_output=True, text=True, timeout=_IDENTITY_TIMEOUT, check=False,
            )  # fmt: skip
        except (OSError, subprocess.TimeoutExpired) as error:
            raise CodegenUnavailable(f"{path} does not run: {error}") from error
        if done.returncode != 0:
            raise CodegenUnavailable(f"{path} {question} fails: {done.stderr.strip()[:_MESSAGE_LENGTH]}")
        lines.append(done.stdout.strip())
    return "\n".join(lines)
