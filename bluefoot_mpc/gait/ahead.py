"""The contacts ahead, in closed form: cheap enough for every tick.

On its limit cycle a leg passes through its swing and its stance at an even pace
(`Rhythm.progress` is linear in time), so the moments of lift-off and touchdown
follow from the leg's present phase, and footholds from the virtual robot's arc.
While the command ramps, pace, share and speed change evenly with time. What this
cannot tell, because the network itself changes (between two gaits, on the way to
rest), `rollout` can.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.gait.engine import GaitEngine
from bluefoot_mpc.gait.footholds import Foot
from bluefoot_mpc.gait.parameters import Parameters
from bluefoot_mpc.gait.state import GaitState
from bluefoot_mpc.gait.virtual_robot import ComplexArray
from bluefoot_mpc.types import ContactSchedule, FloatArray

Number = TypeVar("Number", np.float64, np.complex128)

SLACK = 0.04
"""Share of a cycle by which a leg may be early or late among the others."""
STEADY = 0.02
"""s; a ramp that ends sooner is no ramp: its end is taken for now."""
KNOTS = 5
"""Moments of a ramp at which the gait's parameters are read."""
GRID = 0.02
"""s between the points at which a ramp is integrated."""
_LEGS = np.arange(4)[:, None]


def foreseeable(state: GaitState) -> bool:
    """Whether the gait goes on as it is for as long as the command stays."""
    moving = bool(state.wanted or state.wanted_yaw_rate)
    return state.walking and moving and not state.landing and state.place == state.target


def leg_phases(state: GaitState) -> list[float]:
    """(4,) shares of the cycle since lift-off, in [0, 1]."""
    (y1, y2), phase = state.cpg, state.rhythm.phase
    return [phase(leg, y1[leg], y2[leg]) for leg in range(4)]


def locked(phases: Sequence[float], lag: Sequence[float]) -> bool:
    """Whether the legs follow one another as on the limit cycle, give or take `SLACK`."""
    base = phases[0] + lag[0] + 0.5
    return all(abs((base - p - q) % 1.0 - 0.5) < SLACK for p, q in zip(phases[1:], lag[1:], strict=True))


class _Course(NamedTuple):
    """What one way of looking ahead found.

    Attributes:
        turns: (4, n) phases of the legs at the samples, growing through the cycles.
        share: share of the cycle in swing at the samples, or one for all.
        landing: (4, m) s, when the swing of each cycle ends.
        places: (4, m) where, x + iy, m in the b' of now; shifts not included.
        heading: (4, m) direction of b' then, as e^{iψ}; 1 when it does not turn.
    """

    turns: FloatArray
    share: FloatArray | float
    landing: FloatArray
    places: ComplexArray
    heading: ComplexArray | float


def _ramp(time: FloatArray, state: GaitState, left: tuple[float, float]) -> tuple[ComplexArray, FloatArray]:
    """Velocity, m/s in b', and yaw rate, rad/s, after some times, s, while both approach the command."""
    part = np.minimum(time / max(left[0], 1e-9), 1.0)
    velocity = state.velocity + part * (state.wanted - state.velocity)
    part = np.minimum(time / max(left[1], 1e-9), 1.0)
    return velocity, state.yaw_rate + part * (state.wanted_yaw_rate - state.yaw_rate)


class LookAhead:
    """Contacts and footholds ahead of a foreseeable gait.

    Args:
        engine: equations of the gait.
    """

    def __init__(self, engine: GaitEngine) -> None:
        self._engine = engine
        self._key = (0.0, 0.0)
        self._time = np.zeros(0)
        self._numbers = np.arange(4.0)

    def schedule(self, state: GaitState, horizon: float, dt: float) -> ContactSchedule | None:
        """Contacts over the horizon and footholds in the b' of now, or None if they cannot be foreseen.

        Args:
            state: the gait now; untouched.
            horizon: s.
            dt: s between samples; the first lies one `dt` ahead.
        """
        if not foreseeable(state):
            return None
        phases = leg_phases(state)
        if not locked(phases, state.rhythm.lag):
            return None
        if self._key != (horizon, dt):
            self._key = (horizon, dt)
            self._time = np.arange(1, max(1, round(horizon / dt)) + 1) * np.float64(dt)
        phase = np.array(phases)[:, None]
        velocity_left, yaw_left = self._ramps(state)
        if max(velocity_left, yaw_left) <= STEADY:
            ramps = max(velocity_left, yaw_left) > 0.0
            course = self._steady(state, phase, self._commanded(state) if ramps else state.now)
        else:
            course = self._ramping(state, phase, (velocity_left, yaw_left))
        return self._filled(state, course)

    def _ramps(self, state: GaitState) -> tuple[float, float]:
        """Seconds until velocity and yaw rate are the commanded ones."""
        config = self._engine.config
        velocity = abs(state.wanted - state.velocity) / config.max_acceleration
        return velocity, abs(state.wanted_yaw_rate - state.yaw_rate) / config.max_yaw_acceleration

    def _cycles(self, shortest: float) -> FloatArray:
        """(m,) numbers of the cycles that begin before the horizon's end."""
        count = int(self._time[-1] / shortest) + 2
        if self._numbers.size != count:
            self._numbers = np.arange(float(count))
        return self._numbers

    def _commanded(self, state: GaitState) -> Parameters:
        return self._engine.reader(state).at(state.place, state.wanted, state.wanted_yaw_rate)

    def _steady(self, state: GaitState, phase: FloatArray, now: Parameters) -> _Course:
        cycle, share = now.cycle_time, state.rhythm.share
        turns = phase + self._time / cycle
        landing = (self._cycles(cycle) + (share - phase)) * cycle
        arrival = landing + now.shape.stance_lead * (1.0 - share) * cycle
        nominal = np.array(now.nominal)[:, None]
        velocity, rate = state.wanted, state.wanted_yaw_rate
        if abs(rate) < 1e-6:
            return _Course(turns, share, landing, nominal + velocity * arrival, 1.0)
        turned = np.exp((1j * rate) * arrival)
        centre = velocity / (1j * rate)
        heading = np.exp((1j * rate) * landing)
        return _Course(turns, share, landing, turned * (nominal + centre) - centre, heading)

    def _ramping(self, state: GaitState, phase: FloatArray, left: tuple[float, float]) -> _Course:
        """Pace, share, stance and speed change evenly until the ramp or the horizon ends."""
        end = min(max(left), float(self._time[-1]))
        knots = np.linspace(0.0, end, KNOTS)
        velocity, yaw_rate = _ramp(knots, state, left)
        params = [state.now]
        for v, w in zip(velocity[1:].tolist(), yaw_rate[1:].tolist(), strict=True):
            params.append(self._engine.reader(state).at(state.place, v, w))
        rhythm, place = self._engine.transition.rhythm, state.place
        shares = [rhythm(place, now.shares).share for now in params]
        cycles = [now.cycle_time for now in params]
        grid = np.arange(0.0, self._time[-1] + 2.0 * max(cycles) + GRID, GRID)
        share = np.interp(grid, knots, shares)
        pace = 1.0 / np.interp(grid, knots, cycles)
        turns = _integral(pace)
        speed, rate = _ramp(grid, state, left)
        yaw = _integral(rate)
        track = _integral(speed * np.exp(1j * yaw))
        numbers = self._cycles(min(cycles))
        # A cycle's swing ends when its turns reach the number of the cycle plus the share of then.
        landing = np.interp(numbers - phase, turns - share, grid)
        nominal = np.array(
            [np.interp(landing[leg], knots, [now.nominal[leg] for now in params]) for leg in range(4)]
        )
        ahead = state.now.shape.stance_lead * (1.0 - np.interp(landing, grid, share))
        ahead /= np.interp(landing, grid, pace)
        heading = np.exp(1j * np.interp(landing, grid, yaw))
        turned = np.exp(1j * np.interp(landing, grid, rate) * ahead)
        carried = np.interp(landing, grid, speed) * ahead + turned * nominal
        places = np.interp(landing, grid, track) + heading * carried
        at = np.interp(self._time, grid, turns), np.interp(self._time, grid, share)
        return _Course(phase + at[0], at[1], landing, places, heading)

    def _filled(self, state: GaitState, course: _Course) -> ContactSchedule:
        turns, places = course.turns, course.places
        cycles = np.floor(turns)
        stance = turns - cycles >= course.share
        number = np.minimum(cycles.astype(np.intp), places.shape[1] - 1)
        heights = np.zeros(places.shape)
        uneven = self._shift(state, course, heights)
        for leg, foot in enumerate(state.feet):
            if not foot.swinging:
                places[leg, 0] = state.pose.to_local(foot.anchor)
                heights[leg, 0] = foot.z
                uneven = uneven or foot.z != 0.0
                if foot.turning:
                    stance[leg, number[leg] == 0] = True  # landed before its time
            if foot.goal is not None or foot.later is not None:
                uneven = True
                self._given(state, foot, places[leg], heights[leg])
        footholds = np.zeros((len(self._time), 4, 3))
        chosen = places[_LEGS, number].T
        footholds[:, :, 0] = chosen.real
        footholds[:, :, 1] = chosen.imag
        if uneven:
            footholds[:, :, 2] = heights[_LEGS, number].T
        return ContactSchedule(time=self._time, stance=stance.T, footholds=footholds)

    def _shift(self, state: GaitState, course: _Course, heights: FloatArray) -> bool:
        """Add what displaces virtual footholds (changes places and heights); whether heights did change."""
        if state.wanted_shift:
            np.add(course.places, course.heading * state.wanted_shift, out=course.places)
        if not any(foot.offset or foot.offset_z for foot in state.feet):
            return False
        keep = np.exp(-course.landing / self._engine.config.foothold.offset_time)
        offset = np.array([[foot.offset] for foot in state.feet])
        np.add(course.places, course.heading * offset * keep, out=course.places)
        heights += np.array([[foot.offset_z] for foot in state.feet]) * keep
        return True

    @staticmethod
    def _given(state: GaitState, foot: Foot, places: ComplexArray, heights: FloatArray) -> None:
        """Put footholds given from outside in their places (changes a leg's places and heights)."""
        first, second = (0, 1) if foot.swinging else (1, 1)
        if foot.goal is not None:
            places[first], heights[first] = state.pose.to_local(foot.goal), foot.goal_z
        if foot.later is not None:
            places[second], heights[second] = state.pose.to_local(foot.later[0]), foot.later[1]


def _integral(values: NDArray[Number]) -> NDArray[Number]:
    """Integral over the grid, by trapezes, 0 at its first point."""
    sums = np.zeros_like(values)
    np.cumsum(0.5 * GRID * (values[1:] + values[:-1]), out=sums[1:])
    return sums
