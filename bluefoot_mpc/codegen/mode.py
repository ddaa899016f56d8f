"""What mode is in force, for diagnosis and for pages that quote times."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from bluefoot_mpc.codegen.compiler import CodegenUnavailable, find_compiler
from bluefoot_mpc.codegen.config import SWITCH_VARIABLE, CodegenConfig, cache_folder, switched_on


@dataclass(frozen=True, kw_only=True, slots=True)
class CodegenMode:
    """How functions run.

    Attributes:
        generated: True where functions are built to machine code.
        reason: why not; empty where they are.
        compiler: first line of what the compiler says of itself; empty without one.
        cache: folder of built functions.
    """

    generated: bool
    reason: str
    compiler: str
    cache: Path | None

    def __str__(self) -> str:
        if self.generated:
            return f"generated C ({self.compiler})"
        return f"CasADi virtual machine ({self.reason})"


def compiler_available(config: CodegenConfig | None = None) -> bool:
    """True where a C compiler was found and answers."""
    try:
        find_compiler(config or CodegenConfig())
    except CodegenUnavailable:
        return False
    return True


def codegen_mode(config: CodegenConfig | None = None) -> CodegenMode:
    """The mode that `compiled` would use now; a single function may still fall back."""
    config = config or CodegenConfig()
    reason, compiler, cache = "", "", None
    try:
        compiler = find_compiler(config).identity.splitlines()[1]
    except CodegenUnavailable as error:
        reason = str(error)
    try:
        cache = cache_folder(config)
    except RuntimeError as error:
        reason = reason or f"no cache folder: {error}"
    if cache is not None and not reason and not _writable(cache):
        reason = f"cannot write {cache}"
    if not (config.enabled and switched_on()):
        reason = f"{SWITCH_VARIABLE}=off" if config.enabled else "off by configuration"
    return CodegenMode(generated=not reason, reason=reason, compiler=compiler, cache=cache)


def _writable(folder: Path) -> bool:
    """True where the folder, or the nearest one above it that exists, can be written."""
    existing = next((path for path in (folder, *folder.parents) if path.exists()), None)
    return existing is not None and existing.is_dir() and os.access(existing, os.W_OK)
