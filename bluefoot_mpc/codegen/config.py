"""Choices of code generation, and what the environment says about them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from bluefoot_mpc.exceptions import UnknownNameError
from bluefoot_mpc.settings import require_positive

SWITCH_VARIABLE = "BLUEFOOT_CODEGEN"
CACHE_VARIABLE = "BLUEFOOT_CACHE"

_SWITCH = {"": True, "on": True, "off": False}


@dataclass(frozen=True, kw_only=True, slots=True)
class CodegenConfig:
    """How functions are built.

    `scalar_flags` are for SX functions, which are one straight run of scalar operations:
    there ``-Og`` runs as fast as ``-O1`` and ``-O2`` and builds in 0.7 and 0.25 of their time.
    `matrix_flags` are for all others, whose generated code has loops.

    Attributes:
        compiler: command, words separated as in a shell; empty: ``$CC``, else the
            first of cc, gcc, clang.
        flags: of every build. Contraction would fuse multiply and add, and the results would
            differ from the virtual machine's in the last bit.
        scalar_flags: for SX functions.
        matrix_flags: for all others.
        timeout: s, longest build.
        cache: folder of built functions; None: ``$BLUEFOOT_CACHE``, else the user's cache folder.
        enabled: False keeps the virtual machine.
    """

    compiler: str = ""
    flags: tuple[str, ...] = ("-ffp-contract=off", "-fPIC", "-shared")
    scalar_flags: tuple[str, ...] = ("-Og",)
    matrix_flags: tuple[str, ...] = ("-O2",)
    timeout: float = 300.0  # s
    cache: Path | None = None
    enabled: bool = True

    def __post_init__(self) -> None:
        require_positive(timeout=self.timeout)


def switched_on() -> bool:
    """False where the environment says ``BLUEFOOT_CODEGEN=off``.

    Raises:
        UnknownNameError: the variable is neither on nor off.
    """
    value = os.environ.get(SWITCH_VARIABLE, "").strip().lower()
    if value not in _SWITCH:
        raise UnknownNameError(f"value of {SWITCH_VARIABLE}", value, ("on", "off"))
    return _SWITCH[value]


def cache_folder(config: CodegenConfig) -> Path:
    """Folder of built functions; it need not exist."""
    if config.cache is not None:
        return config.cache
    if named := os.environ.get(CACHE_VARIABLE):
        return Path(named).expanduser() / "codegen"
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path("~/.cache").expanduser()) / "bluefoot-mpc" / "codegen"
