"""What a solver answers."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from bluefoot_mpc.types import FloatArray


class QpStatus(enum.StrEnum):
    """How a solve ended; only ``SOLVED`` gives an x that may be used."""

    SOLVED = "solved"
    MAX_ITERATIONS = "max_iterations"
    INFEASIBLE = "infeasible"
    FAILED = "failed"


@dataclass(frozen=True, kw_only=True, slots=True)
class QpSolution:
    """The answer to one problem.

    Attributes:
        x: (n,) the optimum; only to be used when `ok`. A solver may reuse the
            array on its next solve: copy what must last.
        status: how the solve ended.
        row_multiplier: (m,) of the rows, + at the upper side; None where the solver gives none.
        bound_multiplier: (n,) of the bounds, + at the ceiling; None where the solver gives none.
        iterations: as the solver counts them.
    """

    x: FloatArray
    status: QpStatus
    row_multiplier: FloatArray | None = None
    bound_multiplier: FloatArray | None = None
    iterations: int = 0

    @property
    def ok(self) -> bool:
        """True when x may be used."""
        return self.status is QpStatus.SOLVED
