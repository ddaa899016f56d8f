"""Choices that every solver understands."""

from __future__ import annotations

from dataclasses import dataclass

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_positive


@dataclass(frozen=True, kw_only=True, slots=True)
class SolverOptions:
    """How problems are solved.

    Attributes:
        max_iterations: as the solver counts them; then the status is ``MAX_ITERATIONS``.
        tolerance: what the solver is asked for, in its own measure.
        acceptance: largest violation of a row or bound (in its own unit, relative to its
            size where that is above 1) of an answer that is still called solved.
        fixed_matrices: H and A of the first problem hold until `reset`: they are read,
            checked and factored once, and only vectors are read after.
        verify: compare each answer with rows and bounds (3 µs); False for who does that anyway.
        warm_start: begin at the previous answer; False makes every answer
            depend on its own problem alone.
    """

    max_iterations: int = 200
    tolerance: float = 1e-8
    acceptance: float = 1e-5
    fixed_matrices: bool = False
    verify: bool = True
    warm_start: bool = True

    def __post_init__(self) -> None:
        require_positive(tolerance=self.tolerance, acceptance=self.acceptance)
        if self.max_iterations < 1:
            raise ConfigurationError(f"max_iterations = {self.max_iterations!r} must be at least 1")
