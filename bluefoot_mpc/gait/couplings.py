"""Named gaits: how the four oscillators couple, and how one gait becomes another.

House leg order FL, FR, RL, RR. The matrices are those of the paper's chapter 5,
corrected so that they give the footfall orders it shows: the trot's as
printed (with -1 in the third row), the walk's is the transpose of the printed
one and gives the lateral sequence. `transition` leads from one to the other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from bluefoot_mpc.exceptions import UnknownNameError

Matrix = tuple[float, ...]


@dataclass(frozen=True, kw_only=True, slots=True)
class Coupling:
    """One gait's place in the network.

    Attributes:
        name: name of the gait.
        matrix: 16 entries of K, row-major, unit strength.
        lag: (4,) lags of lift-off behind `leader`, fractions of the cycle.
        leader: leg that lifts first when the gait starts.
        least_stance: fewest feet that this gait leaves on the ground.
    """

    name: str
    matrix: Matrix
    lag: tuple[float, float, float, float]
    leader: int
    least_stance: int


TROT = Coupling(
    name="trot",
    matrix=(0.0, -1.0, -0.5, 1.0, -1.0, 0.0, 1.0, -0.5, -0.5, 1.0, 0.0, -1.0, 1.0, -0.5, -1.0, 0.0),
    lag=(0.0, 0.5, 0.5, 0.0),
    leader=0,
    least_stance=2,
)
WALK = Coupling(
    name="walk",
    matrix=(0.0, -1.0, 0.5, -1.0, -1.0, 0.0, -1.0, 0.5, -0.5, 1.0, 0.0, -1.0, 1.0, -0.5, -1.0, 0.0),
    lag=(0.5, 0.0, 0.25, 0.75),
    leader=1,
    least_stance=3,
)
COUPLINGS: Mapping[str, Coupling] = MappingProxyType({c.name: c for c in (TROT, WALK)})


def coupling(name: str) -> Coupling:
    """The coupling of a named gait.

    Raises:
        UnknownNameError: there is no such gait; the message lists the valid ones.
    """
    try:
        return COUPLINGS[name]
    except (KeyError, TypeError):
        raise UnknownNameError("gait", str(name), COUPLINGS) from None


def scaled(matrix: Sequence[float], gain: float) -> Matrix:
    """`gain` times a coupling matrix."""
    return tuple(gain * entry for entry in matrix)
