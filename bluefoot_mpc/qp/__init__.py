"""Quadratic programs: problem, solution, and solvers by name."""

from bluefoot_mpc.qp.kkt import KktResiduals, residuals
from bluefoot_mpc.qp.options import SolverOptions
from bluefoot_mpc.qp.problem import QpProblem, QpSize
from bluefoot_mpc.qp.registry import SOLVERS, installed_solvers, make_solver
from bluefoot_mpc.qp.solution import QpSolution, QpStatus
from bluefoot_mpc.qp.solver import Solver

__all__ = [
    "SOLVERS",
    "KktResiduals",
    "QpProblem",
    "QpSize",
    "QpSolution",
    "QpStatus",
    "Solver",
    "SolverOptions",
    "installed_solvers",
    "make_solver",
    "residuals",
]
