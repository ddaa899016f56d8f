"""The gait's inner loop: advances a gait state by sub-steps, live or ahead of time."""

from __future__ import annotations

import math

from bluefoot_mpc.gait.config import GaitConfig
from bluefoot_mpc.gait.cpg import CpgInputs, CpgIntegrator
from bluefoot_mpc.gait.footholds import Foot, LegClock, Stride, advance_foot
from bluefoot_mpc.gait.network import coming_to_rest, gated
from bluefoot_mpc.gait.parameters import Basis, ParameterReader, Style, parameter_reader
from bluefoot_mpc.gait.state import GaitState
from bluefoot_mpc.gait.transition import Transition
from bluefoot_mpc.gait.virtual_robot import VirtualPose

CYCLES_TO_CHANGE = 3.0  # fewest cycles from one gait to another; in fewer, legs stall


class GaitEngine:
    """Equations of the gait; all memory is in the `GaitState` that it is given.

    Args:
        config: everything that shapes the gait.
        basis: what the tables leave empty: feet and trunk.
    """

    def __init__(self, config: GaitConfig, basis: Basis) -> None:
        self.config = config
        self.transition = Transition(config)
        self.parameters = parameter_reader(
            (config.trot_table, config.walk_table), (config.trot, config.walk), basis
        )
        self._rough = parameter_reader(
            (config.trot_table, config.rough_table), (config.trot, config.rough), basis
        )
        self._integrator = CpgIntegrator(config.cpg)

    def reader(self, state: GaitState) -> ParameterReader:
        """Parameters over the speed, on the ground that there is."""
        return self._rough if state.rough else self.parameters

    def rest(self) -> GaitState:
        """State of a robot that stands at the origin, ready to trot."""
        now = self.parameters.at(0.0, 0j, 0.0)
        cycle = self.transition.cycle(0.0, now.shares)
        return GaitState(
            cpg=cycle.start,
            rhythm=cycle.rhythm,
            pose=VirtualPose(),
            feet=[Foot(nominal=place, anchor=place, shape=now.shape) for place in now.nominal],
            now=now,
            style=now.style,
            cycle=now.cycle_time,
        )

    def advance(self, state: GaitState, dt: float) -> Stride | None:
        """Advance `state` by `dt` in equal sub-steps; returns the last one's stride."""
        count = max(1, math.ceil(dt / self.config.substep - 1e-9))
        stride = None
        for _ in range(count):
            stride = self._substep(state, dt / count)
        self._restyle(state, dt)
        return stride

    def _substep(self, state: GaitState, dt: float) -> Stride | None:
        if not self._start_or_rest(state):
            return None
        self._ramp(state, dt)
        self._shift(state, dt)
        self._rhythm(state, dt)
        rhythm = state.rhythm
        self._oscillate(state, dt)
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
            height=state.now.step_height,
            apex_y2=rhythm.apex,
            shift=state.reflex.shift,
            landing=state.landing_shift,
            shape=state.now.shape,
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
            state.place = state.target
            state.now = self.reader(state).at(state.place, state.velocity, state.yaw_rate)
            cycle = self.transition.cycle(state.place, state.now.shares)
            state.cpg, state.rhythm = cycle.start, cycle.rhythm
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

    def _rhythm(self, state: GaitState, dt: float) -> None:
        """Move towards the wanted gait; set rhythm, cycle time and all else that follows the speed."""
        if state.place != state.target and not state.landing:
            most = dt / max(self.config.blend_time, CYCLES_TO_CHANGE * state.cycle)
            state.place += min(most, max(-most, state.target - state.place))
        read = (state.place, state.velocity, state.yaw_rate)
        if read == state.read:
            return
        before, state.read = state.now, read
        state.now = now = self.reader(state).at(*read)
        if now is before and not state.landing:
            return
        if not state.landing:
            state.rhythm = self.transition.rhythm(state.place, now.shares)
        state.cycle = now.cycle_time
        if now.nominal is not before.nominal:
            for foot, place in zip(state.feet, now.nominal, strict=True):
                foot.nominal = place  # those in the air turn to it; those that stand go there next

    def _restyle(self, state: GaitState, dt: float) -> None:
        """Let the trunk's parameters follow the table, never in a jump."""
        wanted, style = state.now.style, state.style
        if wanted is not style and wanted != style:
            keep = math.exp(-dt / self.config.style_time)
            state.style = Style(*[b + keep * (a - b) for a, b in zip(style, wanted, strict=True)])

    def _shift(self, state: GaitState, dt: float) -> None:
        """Move the shift of the landing places towards the wanted one."""
        change = state.wanted_shift - state.landing_shift
        if change:
            state.landing_shift += _limited(change, self.config.foothold.shift_rate * dt)

    def _oscillate(self, state: GaitState, dt: float) -> None:
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
            least = self.transition.least_stance(state.place)
            state.cpg = gated(self._integrator, state.cpg, inputs, dt, least)


def _limited(change: complex, most: float) -> complex:
    size = abs(change)
    return change if size <= most else change * (most / size)
