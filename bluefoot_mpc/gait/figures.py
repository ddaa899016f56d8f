"""Data of the paper's gait figures: oscillator series, phase portraits, footfall patterns.

Pure data; drawing belongs to `viz`. A single gait runs without the lift-off gate,
as the paper's does; a transition runs with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from bluefoot_mpc.gait.config import GaitConfig
from bluefoot_mpc.gait.cpg import CpgInputs, CpgIntegrator, CpgState
from bluefoot_mpc.gait.gait import Gait
from bluefoot_mpc.gait.network import gated
from bluefoot_mpc.gait.parameters import NO_STYLE, Basis, parameter_reader
from bluefoot_mpc.gait.state import GaitInputs
from bluefoot_mpc.gait.transition import Transition, place_of
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


@dataclass(frozen=True, kw_only=True, slots=True)
class Sampling:
    """What to show, and of which gait."""

    duration: float = 6.0  # s
    dt: float = 0.005  # s between samples
    speed: float = 0.04  # m/s, sets the cycle time
    config: GaitConfig = field(default_factory=GaitConfig)

    def __post_init__(self) -> None:
        """Check ranges."""
        require_positive(duration=self.duration, dt=self.dt, speed=self.speed)


def cpg_series(gait: str, sampling: Sampling | None = None, start: CpgState | None = None) -> CpgSeries:
    """Oscillators of one gait.

    Args:
        gait: name of the gait.
        sampling: what to show.
        start: initial states; the gait's own limit cycle by default.

    Raises:
        UnknownNameError: there is no such gait.
    """
    return _roll((gait, gait), math.inf, sampling or Sampling(), start)


def transition_series(
    first: str, second: str, change_at: float = 2.0, sampling: Sampling | None = None
) -> CpgSeries:
    """Oscillators while one gait becomes another.

    Args:
        first: gait at the start.
        second: gait at the end.
        change_at: s, when the change is asked for; it takes ``config.blend_time``.
        sampling: what to show.

    Raises:
        UnknownNameError: there is no such gait.
    """
    return _roll((first, second), change_at, sampling or Sampling(duration=12.0), None)


def footfall_pattern(gait: str, stance_feet: FloatArray, sampling: Sampling | None = None) -> FootfallPattern:
    """Footfall pattern of the whole gait at a steady speed.

    Args:
        gait: name of the gait.
        stance_feet: (4, 3) m, nominal feet in b'.
        sampling: what to show, after the ramp has ended.

    Raises:
        UnknownNameError: there is no such gait.
    """
    sampling = sampling or Sampling(dt=0.01)
    config, dt = sampling.config, sampling.dt
    walker = Gait(config, stance_feet)
    inputs = GaitInputs(velocity=np.array([sampling.speed, 0.0]), gait=gait)
    settle = sampling.speed / config.max_acceleration + 1.5
    for _ in range(round(settle / dt)):
        output = walker.step(inputs, dt)
    count = round(sampling.duration / dt)
    stance = np.empty((count, 4), dtype=np.bool_)
    for k in range(count):
        output = walker.step(inputs, dt)
        stance[k] = ~output.phase.swing
    return FootfallPattern(
        gait=gait,
        speed=sampling.speed,
        time=np.arange(count) * np.float64(dt),
        stance=stance,
        cycle_time=output.cycle_time,
        duty=stance.mean(axis=0),
    )


def _roll(gaits: tuple[str, str], change_at: float, sampling: Sampling, start: CpgState | None) -> CpgSeries:
    config = sampling.config
    way = Transition(config)
    basis = Basis(foothold=config.foothold, nominal=(0j,) * 4, style=NO_STYLE)
    reader = parameter_reader((config.trot_table, config.walk_table), (config.trot, config.walk), basis)
    first, second = place_of(gaits[0]), place_of(gaits[1])
    integrator = CpgIntegrator(sampling.config.cpg)
    state = start or way.cycle(first, reader.at(first, complex(sampling.speed), 0.0).shares).start
    count = round(sampling.duration / sampling.dt)
    time = np.arange(count) * np.float64(sampling.dt)
    blend = np.clip((time - change_at) / sampling.config.blend_time, 0.0, 1.0)
    y1, y2 = np.empty((count, 4)), np.empty((count, 4))
    for k, share in enumerate(blend.tolist()):
        y1[k], y2[k] = state.y1, state.y2
        place = first + share * (second - first)
        now = reader.at(place, complex(sampling.speed), 0.0)
        rhythm = way.rhythm(place, now.shares)
        omega = rhythm.turn / now.cycle_time
        inputs = CpgInputs(omega=omega, alpha=rhythm.alpha, matrix=rhythm.matrix)
        if gaits[0] == gaits[1]:
            state = integrator.advance(state, inputs, sampling.dt)
        else:
            state = gated(integrator, state, inputs, sampling.dt, way.least_stance(place))
    name = gaits[0] if gaits[0] == gaits[1] else f"{gaits[0]} to {gaits[1]}"
    return CpgSeries(gait=name, time=time, y1=y1, y2=y2, blend=blend)
