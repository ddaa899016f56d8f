"""The contacts ahead, exactly: a copy of the gait's state is stepped through the horizon."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.gait.engine import GaitEngine
from bluefoot_mpc.gait.footholds import Stride, virtual_foothold
from bluefoot_mpc.gait.reflex import IDLE
from bluefoot_mpc.gait.state import GaitState
from bluefoot_mpc.gait.virtual_robot import VirtualPose
from bluefoot_mpc.types import BoolArray, ContactSchedule, FloatArray

ROLL_AGAIN = 0.1
"""s for which a rolled schedule serves, shifted, unless what is commanded changes its kind."""


class RolledAhead:
    """Rolled schedules for several ticks each: one costs as much as the ticks that it foresees.

    Args:
        engine: equations of the gait.
    """

    def __init__(self, engine: GaitEngine) -> None:
        self._engine = engine
        self.forget()

    def forget(self) -> None:
        """Roll again on the next call."""
        self._kind: tuple[object, ...] = ()
        self._made = 0.0
        self._step = 0.0
        self._plan: ContactSchedule | None = None
        self._pose = VirtualPose()

    def schedule(self, state: GaitState, now: float, horizon: float, dt: float) -> ContactSchedule:
        """The contacts ahead, as rolled out now or up to `ROLL_AGAIN` ago.

        Args:
            state: the gait now; untouched.
            now: s, its age.
            horizon: s.
            dt: s between samples.
        """
        step = dt / max(1, round(dt / self._engine.config.substep / 2.0))
        kind = (horizon, dt, state.walking, state.landing, state.target, bool(state.wanted))
        if self._plan is None or kind != self._kind or now - self._made > ROLL_AGAIN - 1e-9:
            self._plan = roll_out(self._engine, state, horizon + ROLL_AGAIN, step)
            self._kind, self._made, self._step, self._pose = kind, now, step, state.pose
        plan = self._plan
        time = np.arange(1, max(1, round(horizon / dt)) + 1) * np.float64(dt)
        index = np.rint((now - self._made + time) / self._step).astype(np.intp) - 1
        index = np.minimum(index, len(plan.time) - 1)
        footholds = plan.footholds[index]
        if now > self._made:
            places = footholds[..., 0] + 1j * footholds[..., 1]
            places = state.pose.from_frame(self._pose, places)
            footholds[..., 0], footholds[..., 1] = places.real, places.imag
        return ContactSchedule(time=time, stance=plan.stance[index], footholds=footholds)


def roll_out(engine: GaitEngine, live: GaitState, horizon: float, dt: float) -> ContactSchedule:
    """Roll the gait forward under the present command, without reflexes; `live` stays untouched.

    Args:
        engine: equations of the gait.
        live: state now.
        horizon: s.
        dt: s between samples; the first lies one `dt` ahead.
    """
    state = live.copy()
    state.reflex = IDLE
    count = max(1, round(horizon / dt))
    stance = np.empty((count, 4), dtype=np.bool_)
    places = np.empty((count, 4, 3))
    last = None
    for k in range(count):
        last = engine.advance(state, dt)
        for leg, foot in enumerate(state.feet):
            stance[k, leg] = not foot.swinging
            point = live.pose.to_local(foot.anchor)
            places[k, leg] = (point.real, point.imag, foot.z)
    _fill_swings(state, live.pose, stance, places, last)
    return ContactSchedule(time=np.arange(1, count + 1) * np.float64(dt), stance=stance, footholds=places)


def _fill_swings(
    state: GaitState, now: VirtualPose, stance: BoolArray, places: FloatArray, last: Stride | None
) -> None:
    """Give samples in swing the place where the foot lands next (changes `places`)."""
    for leg, foot in enumerate(state.feet):
        landing = places[-1, leg].copy()
        if foot.swinging and last is not None:
            point, height = _landing(state, leg, now, last)
            landing[:] = (point.real, point.imag, height)
        for k in range(len(stance) - 1, -1, -1):
            if stance[k, leg]:
                landing = places[k, leg]
            else:
                places[k, leg] = landing


def _landing(state: GaitState, leg: int, now: VirtualPose, stride: Stride) -> tuple[complex, float]:
    """Where a foot in swing will land: place in the b' of `now` and height, m."""
    foot = state.feet[leg]
    if foot.goal is not None:
        return now.to_local(foot.goal), foot.goal_z
    progress = state.rhythm.progress(state.cpg.y1[leg], state.cpg.y2[leg])[1]
    later = state.pose.moved(state.velocity, state.yaw_rate, (1.0 - progress) * stride.swing_time)
    return now.to_local(later.to_world(virtual_foothold(foot, stride))), foot.offset_z
