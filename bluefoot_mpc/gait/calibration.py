"""What the coupled network really does, measured once per gait.

Coupling changes period, swing share, amplitude and the speed along the cycle
(trot +8 %, walk -27 % in period at the usual constants; a walk with α = 0.25
swings for 32 % of its cycle, so that two legs fly at once). Coupling and
radial gain scale with ω_s, so ω_s times the period is a constant, and one
measured limit cycle serves every speed.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.gait.couplings import Coupling, Matrix, scaled
from bluefoot_mpc.gait.cpg import CpgConfig, CpgInputs, CpgState, angle_fraction, on_circle, trajectory
from bluefoot_mpc.types import FloatArray

TABLE = 16  # intervals of the tables that turn angle into time
_CYCLES = 12  # settle, then measure the last ones
_STEP = 0.1  # rad at ω_s = 1


@dataclass(frozen=True, kw_only=True, slots=True)
class Rhythm:
    """Limit cycle of a coupled gait, or a mixture of several.

    Attributes:
        matrix: 16 entries of K over ω_s.
        alpha: α that gives the swing share.
        turn: ω_s times the period, rad.
        share: real share of the cycle spent in swing.
        apex: largest y2 of the cycle.
        swing_time: share of the swing's time passed at equal shares of its angle.
        stance_time: the same for stance.
        rear_stance_time: the same for the stance of hind legs, which a walk paces otherwise.
        lag: (4,) lags of lift-off behind the leader, fractions of the cycle in [-1/4, 3/4).
    """

    matrix: Matrix
    alpha: float
    turn: float
    share: float
    apex: float
    swing_time: tuple[float, ...]
    stance_time: tuple[float, ...]
    rear_stance_time: tuple[float, ...]
    lag: tuple[float, ...]

    def progress(self, y1: float, y2: float) -> tuple[bool, float]:
        """Whether a leg swings, and the share of that part's time passed, in [0, 1]."""
        swing, fraction = angle_fraction(y1, y2)
        table = self.swing_time if swing else self.stance_time
        place = fraction * TABLE
        index = min(TABLE - 1, int(place))
        low = table[index]
        return swing, low + (place - index) * (table[index + 1] - low)

    def phase(self, leg: int, y1: float, y2: float) -> float:
        """Share of the cycle's time since the leg's lift-off, in [0, 1]."""
        if leg < 2 or y2 > 0.0:
            swing, part = self.progress(y1, y2)
            return self.share * part if swing else self.share + (1.0 - self.share) * part
        place = angle_fraction(y1, y2)[1] * TABLE
        index = min(TABLE - 1, int(place))
        low = self.rear_stance_time[index]
        part = low + (place - index) * (self.rear_stance_time[index + 1] - low)
        return self.share + (1.0 - self.share) * part


@dataclass(frozen=True, kw_only=True, slots=True)
class LimitCycle:
    """A measured gait.

    Attributes:
        rhythm: what the gait needs at run time.
        start: state at the leader's lift-off.
    """

    rhythm: Rhythm
    start: CpgState


@functools.lru_cache(maxsize=64)
def calibrate(coupling: Coupling, gain: float, share: float, config: CpgConfig) -> LimitCycle:
    """Find the α that gives the wanted swing share, and measure its limit cycle.

    Args:
        coupling: the gait.
        gain: strength of the coupling over ω_s.
        share: wanted share of the cycle spent in swing.
        config: constants of the oscillators.

    Raises:
        ConfigurationError: the coupling stalls the network, or no α gives that share.
    """
    low, high = 0.02, 0.75
    low_error, high_error = -share, 0.75 - share
    cycle = None
    for _ in range(12):
        # False position, kept off the ends so that a stalled side cannot trap it.
        weight = min(0.9, max(0.1, low_error / (low_error - high_error)))
        alpha = low + weight * (high - low)
        cycle = measure(coupling, gain, alpha, config)
        error = -share if cycle is None else cycle.rhythm.share - share
        if cycle is not None and abs(error) < 5e-4:
            return cycle
        if error < 0.0:
            low, low_error = alpha, error
        else:
            high, high_error = alpha, error
    found = "stalls" if cycle is None else f"reaches {cycle.rhythm.share:.3f}"
    raise ConfigurationError(
        f"swing_share = {share!r} is out of reach: {coupling.name} with coupling_gain = {gain!r} {found}"
    )


def measure(coupling: Coupling, gain: float, alpha: float, config: CpgConfig) -> LimitCycle | None:
    """Limit cycle at a given α, or None when the network stalls."""
    matrix = scaled(coupling.matrix, gain)
    inputs = CpgInputs(omega=1.0, alpha=alpha, matrix=matrix)
    states = _simulate(coupling, inputs, config)
    lead_y2 = states[:, 4 + coupling.leader]
    rises = np.flatnonzero((lead_y2[:-1] <= 0.0) & (lead_y2[1:] > 0.0))
    if rises.size < 4:
        return None
    lift = [_crossing(states[:, 4 + leg]) for leg in range(4)]
    end, begin = lift[coupling.leader][-1], lift[coupling.leader][-2]
    period = end - begin
    falls = _crossing(-lead_y2)
    down = falls[(falls > begin) & (falls < end)][0]
    lags = tuple(float(((times[-1] - begin) / period + 0.25) % 1.0) - 0.25 for times in lift)
    first = rises[-2]
    blend = begin - first
    start = (1.0 - blend) * states[first] + blend * states[first + 1]
    start[4:][np.abs(start[4:]) < 1e-3] = 0.0  # the leader, and whoever lifts with it
    a, b, c, d, e, f, g, h = start.tolist()
    rear = 3 - coupling.leader
    rhythm = Rhythm(
        matrix=matrix,
        alpha=alpha,
        turn=float(period) * _STEP,
        share=float((down - begin) / period),
        apex=float(lead_y2[first:].max()),
        swing_time=_time_table(states, coupling.leader, begin, down),
        stance_time=_time_table(states, coupling.leader, down, end),
        rear_stance_time=_time_table(states, rear, *_last_stance(states[:, 4 + rear])),
        lag=lags,
    )
    return LimitCycle(rhythm=rhythm, start=CpgState(y1=(a, b, c, d), y2=(e, f, g, h)))


def mix(first: Rhythm, second: Rhythm, weight: float) -> Rhythm:
    """Linear mixture of two rhythms; `weight` in [0, 1] is that of the second."""

    def blend(a: float, b: float) -> float:
        return a + weight * (b - a)

    return Rhythm(
        matrix=tuple(map(blend, first.matrix, second.matrix)),
        alpha=blend(first.alpha, second.alpha),
        turn=blend(first.turn, second.turn),
        share=blend(first.share, second.share),
        apex=blend(first.apex, second.apex),
        swing_time=tuple(map(blend, first.swing_time, second.swing_time)),
        stance_time=tuple(map(blend, first.stance_time, second.stance_time)),
        rear_stance_time=tuple(map(blend, first.rear_stance_time, second.rear_stance_time)),
        lag=tuple(map(blend, first.lag, second.lag)),
    )


def _simulate(coupling: Coupling, inputs: CpgInputs, config: CpgConfig) -> FloatArray:
    """(n, 8) states over some cycles at ω_s = 1, from the target phases."""
    cycle = np.pi / (inputs.alpha * (1.0 - inputs.alpha))
    count = int(_CYCLES * min(cycle, 60.0) / _STEP)
    start = on_circle([-lag for lag in coupling.lag], inputs.alpha)
    # Steps may have to be finer than the samples.
    fine = max(1, math.ceil(0.5 * _STEP / config.max_step - 1e-9))
    return trajectory(start, inputs, _STEP / fine, fine * count, config)[fine - 1 :: fine]


def _crossing(values: FloatArray) -> FloatArray:
    """Sample numbers, with fractions, at which `values` becomes positive."""
    k = np.flatnonzero((values[:-1] <= 0.0) & (values[1:] > 0.0))
    return np.asarray(k + values[k] / (values[k] - values[k + 1]))


def _last_stance(y2: FloatArray) -> tuple[float, float]:
    """Sample numbers, with fractions, at which the last whole stance of a leg begins and ends."""
    lift, down = _crossing(y2), _crossing(-y2)
    end = lift[-1]
    return float(down[down < end][-1]), float(end)


def _time_table(states: FloatArray, leg: int, begin: float, end: float) -> tuple[float, ...]:
    """Shares of time at TABLE + 1 equal shares of the half turn between two crossings."""
    inner = np.arange(int(np.ceil(begin)), int(np.floor(end)) + 1)
    fraction = [angle_fraction(states[k, leg], states[k, 4 + leg])[1] for k in inner]
    time = (inner - begin) / (end - begin)
    table = np.interp(np.linspace(0.0, 1.0, TABLE + 1), np.r_[0.0, fraction, 1.0], np.r_[0.0, time, 1.0])
    return (0.0, *table[1:-1].tolist(), 1.0)
