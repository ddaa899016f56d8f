"""Solvers by name; a backend is imported when it is asked for."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from dataclasses import dataclass

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.qp.options import SolverOptions
from bluefoot_mpc.qp.problem import QpSize
from bluefoot_mpc.qp.solver import Solver

_Maker = Callable[[QpSize, SolverOptions], Solver]


@dataclass(frozen=True, kw_only=True, slots=True)
class _Entry:
    """One solver.

    Attributes:
        make: imports the backend and makes a solver.
        module: what must be installed.
        package: what installs it.
    """

    make: _Maker
    module: str
    package: str


def _daqp(size: QpSize, options: SolverOptions) -> Solver:
    from bluefoot_mpc.qp.backends.daqp import DaqpSolver  # noqa: PLC0415

    return DaqpSolver(size, options)


def _proxsuite(size: QpSize, options: SolverOptions) -> Solver:
    from bluefoot_mpc.qp.backends.proxsuite import ProxsuiteSolver  # noqa: PLC0415

    return ProxsuiteSolver(size, options)


def _general(name: str) -> _Maker:
    def make(size: QpSize, options: SolverOptions) -> Solver:
        from bluefoot_mpc.qp.backends.general import GeneralSolver  # noqa: PLC0415

        return GeneralSolver(name, size, options)

    return make


def _conic(plugin: str) -> _Maker:
    def make(size: QpSize, options: SolverOptions) -> Solver:
        from bluefoot_mpc.qp.backends.conic import ConicSolver  # noqa: PLC0415

        return ConicSolver(plugin, size, options)

    return make


_ENTRIES = {
    "daqp": _Entry(make=_daqp, module="daqp", package="daqp"),
    "proxsuite": _Entry(make=_proxsuite, module="proxsuite", package="proxsuite"),
    "quadprog": _Entry(make=_general("quadprog"), module="quadprog", package="quadprog"),
    "osqp": _Entry(make=_general("osqp"), module="osqp", package="osqp"),
    "piqp": _Entry(make=_general("piqp"), module="piqp", package="piqp"),
    "clarabel": _Entry(make=_general("clarabel"), module="clarabel", package="clarabel"),
    "highs": _Entry(make=_general("highs"), module="highspy", package="highspy"),
    "scs": _Entry(make=_general("scs"), module="scs", package="scs"),
    **{
        f"casadi-{plugin}": _Entry(make=_conic(plugin), module="casadi", package="casadi")
        for plugin in ("qrqp", "qpoases", "osqp", "daqp", "proxqp")
    },
}

SOLVERS: tuple[str, ...] = tuple(_ENTRIES)
"""All names that `make_solver` knows, installed or not."""


def installed_solvers() -> tuple[str, ...]:
    """Names of the solvers whose packages are installed."""
    return tuple(name for name, entry in _ENTRIES.items() if _is_installed(entry))


def make_solver(name: str, size: QpSize, options: SolverOptions | None = None) -> Solver:
    """A solver for problems of one size.

    Args:
        name: one of `SOLVERS`.
        size: of all problems that it will be given.
        options: how to solve.

    Raises:
        UnknownNameError: there is no solver of that name.
        ConfigurationError: its package is not installed.
    """
    entry = _ENTRIES.get(name)
    if entry is None:
        raise UnknownNameError("solver", name, SOLVERS)
    if not _is_installed(entry):
        installed = ", ".join(installed_solvers())
        raise ConfigurationError(
            f"solver '{name}' is not installed: pip install {entry.package}. Installed: {installed}"
        )
    return entry.make(size, options or SolverOptions())


def _is_installed(entry: _Entry) -> bool:
    return importlib.util.find_spec(entry.module) is not None
