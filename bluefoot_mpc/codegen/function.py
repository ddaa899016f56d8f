"""A CasADi function as machine code, or the function itself where that cannot be had."""

from __future__ import annotations

import functools
import logging

import casadi as ca

from bluefoot_mpc.codegen.compiler import CodegenUnavailable, build, find_compiler
from bluefoot_mpc.codegen.config import SWITCH_VARIABLE, CodegenConfig, cache_folder, switched_on
from bluefoot_mpc.codegen.store import key_of, obtain
from bluefoot_mpc.exceptions import ConfigurationError

log = logging.getLogger(__name__)

_OWNED_BY_C = """
    auto break case char const continue default do double else enum extern float for goto if inline int
    long register restrict return short signed sizeof static struct switch typedef union unsigned void
    volatile while asm typeof main abs acos asin atan atan2 ceil cos cosh erf exp fabs floor fmax fmin
    fmod gamma hypot log log10 pow round sin sinh sqrt tan tanh y0 y1 j0 j1 memcpy memset printf
"""
_RESERVED = frozenset(_OWNED_BY_C.split())


def compiled(function: ca.Function, config: CodegenConfig | None = None) -> ca.Function:
    """The same function built from generated C, bit for bit the same results.

    It is built at most once per content (C text, flags, compiler, CasADi's
    version) and user. Without a compiler, where building or loading fails, the
    cache cannot be written, or ``BLUEFOOT_CODEGEN=off`` is set, the given
    function comes back, and the cause is logged once.

    Args:
        function: any function that CasADi can export; its name becomes a name in C.
        config: how to build.

    Raises:
        ConfigurationError: the function's name is no free name in C.
    """
    config = config or CodegenConfig()
    _require_free_name(function.name())
    if function.class_name() == "External":  # built already
        return function
    if not (config.enabled and switched_on()):
        where = "its configuration" if not config.enabled else f"{SWITCH_VARIABLE}=off"
        _say_once(logging.INFO, f"code generation is off ({where}): the CasADi virtual machine is used")
        return function
    try:
        return _external(function, config)
    except CodegenUnavailable as error:
        _say_once(logging.WARNING, f"no generated code, the slower CasADi virtual machine is used: {error}")
        return function


def _external(function: ca.Function, config: CodegenConfig) -> ca.Function:
    """The built function.

    Raises:
        CodegenUnavailable: it cannot be had; the message says why.
    """
    compiler = find_compiler(config)
    source = _source(function)
    specific = config.scalar_flags if function.is_a("SXFunction") else config.matrix_flags
    flags = (*specific, *config.flags)
    key = key_of(source, " ".join(flags), compiler.identity, ca.CasadiMeta.version())
    try:
        folder = cache_folder(config)
    except RuntimeError as error:  # no home folder
        raise CodegenUnavailable(f"no cache folder: {error}") from error
    path = folder / f"{function.name()}_{key}.so"
    obtain(path, lambda target: build(compiler, source, flags, target, config.timeout))
    try:
        built = ca.external(function.name(), str(path.resolve()))
    except RuntimeError as error:
        raise CodegenUnavailable(f"cannot load {path}: {_last_line(error)}") from error
    if not _same_signature(function, built):
        raise CodegenUnavailable(f"{path} holds another function; delete it")
    return built


def _source(function: ca.Function) -> str:
    """C text of a function."""
    try:
        generator = ca.CodeGenerator(f"{function.name()}.c")
        generator.add(function)
        text: str = generator.dump()
    except RuntimeError as error:
        raise CodegenUnavailable(f"'{function.name()}' has no C form: {_last_line(error)}") from error
    return text


def _same_signature(a: ca.Function, b: ca.Function) -> bool:
    """True when names and sparsities of all inputs and outputs agree."""
    if a.name_in() != b.name_in() or a.name_out() != b.name_out():
        return False
    inputs = all(a.sparsity_in(i) == b.sparsity_in(i) for i in range(a.n_in()))
    return inputs and all(a.sparsity_out(i) == b.sparsity_out(i) for i in range(a.n_out()))


def _require_free_name(name: str) -> None:
    # CasADi has checked the form of the name already; what C and its mathematics
    # library own is left.
    if name in _RESERVED or name.startswith("casadi_"):
        raise ConfigurationError(f"a function to be compiled cannot be named '{name}': C owns that name")


def _last_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else type(error).__name__


@functools.cache
def _say_once(level: int, message: str) -> None:
    log.log(level, "%s", message)
