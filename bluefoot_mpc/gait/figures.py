"""Data of the paper's gait figures: oscillator series, phase portraits, footfall patterns.

Pure data; drawing belongs to `viz`. The network runs in it without the lift-off
gate, as the paper's does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.gait.calibration import calibrate, mix
from bluefoot_mpc.gait.config import GaitConfig
from bluefoot_mpc.gait.couplings import coupling
from bluefoot_mpc.gait.cpg import CpgInputs, CpgIntegrator, CpgState
from bluefoot_mpc.gait.gait import Gait
from bluefoot_mpc.gait.state import GaitInputs
from bluefoot_mpc.gait.timing import cycle_time
from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.types import BoolArray, FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class CpgSeries:
    """Oscillator states over time; y1 against y2 is the phase portrait.

    Attributes:
        gait: name, or ``"a to b"`` for a transition.
        time: (n,) s.
        y1: (n, 4) first states, legs FL, FR, RL, RR.
        y2: (n, 4) second states; positive while the leg swings.
        blend: (n,) share of the second gait; zeros without a transition.
    """

    gait: str
    time: FloatArray
    y1: FloatArray
    y2: FloatArray
    blend: FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class FootfallPattern:
    """Which feet stand when, once the gait is steady.

    Attributes:
        gait: name.
        speed: m/s.
        time: (n,) s.
        stance: (n, 4) True where the foot stands.
        cycle_time: s.
        duty: (4,) measured share of the time in stance.
    """

    gait: str
    speed: float
    time: FloatArray
    stance: BoolArray
    cycle_time: float
    duty: FloatArray


def cpg_series(
    gait: str,
    duration: float,
    speed: float = 0.04,
    dt: float = 0.005,
    config: GaitConfig | None = None,
    start: CpgState | None = None,
) -> CpgSeries:
    """Oscillators of one gait.

    Args:
        gait: name of the gait.
        duration: s.
        speed: m/s, sets the cycle time.
        dt: s between samples.
        config: gait configuration, or the default.
        start: initial states; the gait's own limit cycle by default.

    Raises:
        UnknownNameError: there is no such gait.
    """
    return _roll((gait, gait), duration, speed, dt, config or GaitConfig(), start, None)


def transition_series(
    first: str,
    second: str,
    duration: float,
    change_at: float,
    speed: float = 0.04,
    dt: float = 0.005,
    config: GaitConfig | None = None,
) -> CpgSeries:
    """Oscillators while one gait becomes another; arguments as `cpg_series`.

    Args:
        first: gait at the start.
        second: gait at the end.
        duration: s.
        change_at: s, when the change is asked for; it takes ``config.blend_time``.
        speed: m/s.
        dt: s between samples.
        config: gait configuration, or the default.
    """
    return _roll((first, second), duration, speed, dt, config or GaitConfig(), None, change_at)


def footfall_pattern(
    gait: str,
    stance_feet: FloatArray,
    speed: float = 0.04,
    duration: float = 6.0,
    dt: float = 0.01,
    config: GaitConfig | None = None,
) -> FootfallPattern:
    """Footfall pattern of the whole gait at a steady speed.

    Args:
        gait: name of the gait.
        stance_feet: (4, 3) m, nominal feet in b'.
        speed: m/s.
        duration: s shown, after the ramp has ended.
        dt: s between samples.
        config: gait configuration, or the default.
    """
    require_positive(speed=speed, duration=duration, dt=dt)
    config = config or GaitConfig()
    walker = Gait(config, stance_feet)
    inputs = GaitInputs(velocity=np.array([speed, 0.0]), gait=gait)
    settle = speed / config.max_acceleration + config.timing(gait).cycle_max
    for _ in range(round(settle / dt)):
        output = walker.step(inputs, dt)
    count = round(duration / dt)
    stance = np.empty((count, 4), dtype=np.bool_)
    for k in range(count):
        output = walker.step(inputs, dt)
        stance[k] = ~output.phase.swing
    return FootfallPattern(
        gait=gait,
        speed=speed,
        time=np.arange(count) * np.float64(dt),
        stance=stance,
        cycle_time=output.cycle_time,
        duty=stance.mean(axis=0),
    )


def _roll(
    gaits: tuple[str, str],
    duration: float,
    speed: float,
    dt: float,
    config: GaitConfig,
    start: CpgState | None,
    change_at: float | None,
) -> CpgSeries:
    require_positive(duration=duration, dt=dt, speed=speed)
    timings = [config.timing(coupling(name).name) for name in gaits]
    cycles = [
        calibrate(coupling(name), timing.coupling_gain, timing.swing_share, config.cpg)
        for name, timing in zip(gaits, timings, strict=True)
    ]
    periods = [cycle_time(speed, 0.0, timing) for timing in timings]
    integrator = CpgIntegrator(config.cpg)
    state = start or cycles[0].start
    count = round(duration / dt)
    time = np.arange(count) * np.float64(dt)
    begin = np.inf if change_at is None else change_at
    blend = np.clip((time - begin) / config.blend_time, 0.0, 1.0)
    y1, y2 = np.empty((count, 4)), np.empty((count, 4))
    for k, share in enumerate(blend.tolist()):
        y1[k], y2[k] = state.y1, state.y2
        rhythm = mix([c.rhythm for c in cycles], (1.0 - share, share))
        period = (1.0 - share) * periods[0] + share * periods[1]
        inputs = CpgInputs(omega=rhythm.turn / period, alpha=rhythm.alpha, matrix=rhythm.matrix)
        state = integrator.advance(state, inputs, dt)
    name = gaits[0] if change_at is None else f"{gaits[0]} to {gaits[1]}"
    return CpgSeries(gait=name, time=time, y1=y1, y2=y2, blend=blend)
