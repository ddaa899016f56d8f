"""The gait's inner loop: advances a gait state by sub-steps, live or ahead of time."""

from __future__ import annotations

import math

from bluefoot_mpc.gait.calibration import LimitCycle, calibrate, mix
from bluefoot_mpc.gait.config import GaitConfig
from bluefoot_mpc.gait.couplings import COUPLINGS, coupling, shift_weights
from bluefoot_mpc.gait.cpg import CpgInputs, CpgIntegrator
from bluefoot_mpc.gait.footholds import Foot, LegClock, Stride, advance_foot
from bluefoot_mpc.gait.network import coming_to_rest, gated
from bluefoot_mpc.gait.state import GaitState
from bluefoot_mpc.gait.timing import cycle_time, step_height
from bluefoot_mpc.gait.virtual_robot import VirtualPose

NAMES = tuple(COUPLINGS)
_LEAST_IN_TRANSITION = 2


class GaitEngine:
    """Equations of the gait; all memory is in the `GaitState` that it is given.

    Args:
        config: everything that shapes the gait.
    """

    def __init__(self, config: GaitConfig) -> None:
        self.config = config
        self.cycles = tuple(self._calibrated(name) for name in NAMES)
        self._timings = tuple(config.timing(name) for name in NAMES)
        self._integrator = CpgIntegrator(config.cpg)

    def rest(self, nominal: tuple[complex, ...]) -> GaitState:
        """State of a robot that stands at the origin.

        Args:
            nominal: (4,) feet in b' as x + iy, m.
        """
        return GaitState(
            cpg=self.cycles[0].start,
            rhythm=self.cycles[0].rhythm,
            pose=VirtualPose(),
            feet=[Foot(nominal=place, anchor=place) for place in nominal],
            weights=tuple(float(i == 0) for i in range(len(NAMES))),
            target=0,
            cycle=self._timings[0].cycle_max,
        )

    def _calibrated(self, name: str) -> LimitCycle:
        timing = self.config.timing(name)
        return calibrate(coupling(name), timing.coupling_gain, timing.swing_share, self.config.cpg)

    def advance(self, state: GaitState, dt: float) -> Stride | None:
        """Advance `state` by `dt` in equal sub-steps; returns the last one's stride."""
        count = max(1, math.ceil(dt / self.config.substep - 1e-9))
        stride = None
        for _ in range(count):
            stride = self._substep(state, dt / count)
        return stride

    def _substep(self, state: GaitState, dt: float) -> Stride | None:
        if not self._start_or_rest(state):
            return None
        self._ramp(state, dt)
        height, least = self._rhythm(state, dt)
        rhythm = state.rhythm
        self._oscillate(state, least, dt)
        before = state.pose
        state.pose = before.moved(state.velocity, state.yaw_rate, dt)
        stride = Stride(
            before=before,
            after=state.pose,
            velocity=state.velocity,
            yaw_rate=state.yaw_rate,
            dt=dt,
            swing_time=rhythm.share * state.cycle,
            stance_time=(1.0 - rhythm.share) * state.cycle,
            height=height,
            apex_y2=rhythm.apex,
            shift=state.reflex.shift,
        )
        for leg, foot in enumerate(state.feet):
            y2 = state.cpg.y2[leg]
            if y2 <= 0.0 and not (foot.turning or foot.offset or foot.offset_z):
                continue  # stands, and nothing about it changes
            swing, progress = rhythm.progress(state.cpg.y1[leg], y2)
            lower = 1.0 / math.sqrt(state.reflex.psi_m[leg])
            clock = LegClock(swing=swing, progress=progress, y2=y2, lower=lower)
            advance_foot(foot, clock, stride, self.config.foothold)
        return stride

    def _start_or_rest(self, state: GaitState) -> bool:
        """Start walking, or come to rest; False when the network rests."""
        moving = bool(state.wanted or state.wanted_yaw_rate)
        if state.landing and all(value <= 0.0 for value in state.cpg.y2):
            state.walking = state.landing = False
        if not state.walking and moving:
            state.walking = True
            state.weights = tuple(float(i == state.target) for i in range(len(NAMES)))
            state.cpg = self.cycles[state.target].start
        return state.walking

    def _ramp(self, state: GaitState, dt: float) -> None:
        if state.landing:
            return
        state.velocity += _limited(state.wanted - state.velocity, self.config.max_acceleration * dt)
        most = self.config.max_yaw_acceleration * dt
        state.yaw_rate += min(most, max(-most, state.wanted_yaw_rate - state.yaw_rate))
        if state.wanted or state.wanted_yaw_rate or state.velocity or state.yaw_rate:
            state.idle = 0.0
            return
        state.idle += dt / state.cycle
        state.landing = state.idle >= self.config.settle_cycles

    def _rhythm(self, state: GaitState, dt: float) -> tuple[float, int]:
        """Set rhythm and cycle time; returns step height and least stance of this step."""
        if state.weights[state.target] < 1.0 and not state.landing:
            state.weights = shift_weights(state.weights, state.target, dt / self.config.blend_time)
        speed, turn = abs(state.velocity), abs(state.yaw_rate)
        if 1.0 in state.weights:
            index = state.weights.index(1.0)
            timing = self._timings[index]
            state.cycle = cycle_time(speed, turn, timing)
            least = COUPLINGS[NAMES[index]].least_stance
            state.rhythm = self.cycles[index].rhythm
            return step_height(speed, turn, timing), least
        parts = list(zip(state.weights, self._timings, strict=True))
        state.cycle = sum(w * cycle_time(speed, turn, t) for w, t in parts)
        height = sum(w * step_height(speed, turn, t) for w, t in parts)
        state.rhythm = mix([c.rhythm for c in self.cycles], state.weights)
        return height, _LEAST_IN_TRANSITION

    def _oscillate(self, state: GaitState, least: int, dt: float) -> None:
        rhythm = state.rhythm
        inputs = CpgInputs(
            omega=rhythm.turn / state.cycle,
            alpha=rhythm.alpha,
            matrix=rhythm.matrix,
            psi_omega=state.reflex.psi_omega,
            psi_m=state.reflex.psi_m,
        )
        if state.landing:
            state.cpg = coming_to_rest(self._integrator, state.cpg, inputs, dt)
        else:
            state.cpg = gated(self._integrator, state.cpg, inputs, dt, least)


def _limited(change: complex, most: float) -> complex:
    size = abs(change)
    return change if size <= most else change * (most / size)
