"""The gait: from a velocity command to swing states and feet in the robot-relative frame."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.gait.ahead import LookAhead, leg_phases
from bluefoot_mpc.gait.config import GaitConfig
from bluefoot_mpc.gait.engine import GaitEngine
from bluefoot_mpc.gait.footholds import Foot, Stride, early_contact, freeze
from bluefoot_mpc.gait.motion import FootMotion, feet_ahead
from bluefoot_mpc.gait.parameters import NO_STYLE, Basis, Style
from bluefoot_mpc.gait.reflex import IDLE, ReflexOutput, is_quiet, reflex
from bluefoot_mpc.gait.rollout import RolledAhead, roll_out
from bluefoot_mpc.gait.state import GaitInputs, GaitOutput, GaitState
from bluefoot_mpc.gait.transition import place_of
from bluefoot_mpc.gait.virtual_robot import VirtualPose
from bluefoot_mpc.types import BoolArray, ContactSchedule, FloatArray, GaitPhase

__all__ = ["FootMotion", "Gait", "GaitConfig", "GaitInputs", "GaitOutput", "Style"]


class Gait:
    """Pattern generator, virtual robot and feet of one walking robot.

    Args:
        config: everything that shapes the gait.
        stance_feet: (4, 3) m, nominal feet in b'; their height is not used
            (feet stand on the ground plane of b').
        style: trunk parameters where the tables have none; given back in the output.

    Raises:
        ConfigurationError: the feet are not four finite points, or the network
            cannot give a wanted swing share.
    """

    def __init__(self, config: GaitConfig, stance_feet: FloatArray, style: Style | None = None) -> None:
        feet = np.asarray(stance_feet, dtype=float)
        if feet.shape != (4, 3) or not np.all(np.isfinite(feet)):
            raise ConfigurationError(f"stance feet must be 4 finite points, not {feet.tolist()!r}")
        self.config = config
        nominal = tuple(complex(x, y) for x, y, _ in feet.tolist())
        basis = Basis(foothold=config.foothold, nominal=nominal, style=style or NO_STYLE)
        self._engine = GaitEngine(config, basis)
        self._ahead = LookAhead(self._engine)
        self._rolled = RolledAhead(self._engine)
        self.reset()

    def reset(self) -> None:
        """Stand at the origin with every foot at its nominal place."""
        self.state = self._engine.rest()
        self._elapsed = 0.0
        self._rolled.forget()

    def step(self, inputs: GaitInputs, dt: float) -> GaitOutput:
        """Advance by one tick.

        Commands that are not finite are ignored and the last good ones kept.

        Args:
            inputs: command and estimates.
            dt: s.

        Raises:
            UnknownNameError: there is no such gait.
        """
        state = self.state
        self._accept(state, inputs)
        contact: list[bool] = np.asarray(inputs.contact, dtype=bool).tolist()
        state.reflex = self._reflex(state, inputs, contact)
        stride = self._engine.advance(state, dt)
        self._elapsed += dt
        if state.walking and stride is not None and self.config.foothold.early_contact:
            self._check_contacts(state, contact, _estimates(inputs.foot_position), stride)
        return self._output(state)

    def schedule(self, horizon: float, dt: float, *, exact: bool = False) -> ContactSchedule:
        """Contacts ahead under the present command; the live state stays untouched.

        In closed form while the gait goes on as it is. Between two gaits, and on
        the way to rest, the network itself is rolled forward, and what that
        found serves for `ROLL_AGAIN` seconds.

        Args:
            horizon: s.
            dt: s between samples; the first lies one `dt` ahead.
            exact: roll the network forward in any case, and now.

        Returns:
            Contacts, and footholds in the b' of now: where each foot stands, or
            will stand next. Its arrays are the caller's, except `time`.
        """
        if exact:
            return roll_out(self._engine, self.state, horizon, dt)
        plan = self._ahead.schedule(self.state, horizon, dt)
        if plan is None:
            return self._rolled.schedule(self.state, self._elapsed, horizon, dt)
        self._rolled.forget()
        return plan

    def feet_ahead(self, lead: float = 0.0) -> FootMotion:
        """Planned feet with velocity and acceleration, `lead` seconds from now; see `motion`."""
        return feet_ahead(self.state, lead, self.config.foothold)

    def set_footholds(self, footholds: FloatArray, given: Sequence[bool] | BoolArray) -> BoolArray:
        """Replace the places where feet land next.

        A foot in the air on a minimum-jerk path takes its new foothold from the
        next lift-off on; on the paper's law it turns to it at once. Each is
        used once. One that will lie out of reach when the foot gets there, at
        the present twist, is drawn in.

        Args:
            footholds: (4, 3) m in the b' of now.
            given: (4,) True where the row holds a foothold.

        Returns:
            (4,) True where a foothold was taken as it was given.
        """
        state = self.state
        taken = np.zeros(4, dtype=np.bool_)
        places = np.asarray(footholds, dtype=float).tolist()
        for leg, (foot, place, phase) in enumerate(zip(state.feet, places, leg_phases(state), strict=True)):
            if not given[leg] or not all(map(math.isfinite, place)):
                continue
            waits = foot.swinging and foot.shape.law == "minimum_jerk"
            # Turns until the foot lands there: at the end of this swing, or of the next one.
            turns = state.rhythm.share - phase + (0.0 if foot.swinging and not waits else 1.0)
            landing = state.pose.moved(state.velocity, state.yaw_rate, turns * state.cycle)
            wanted = state.pose.to_world(complex(place[0], place[1]))
            goal, taken[leg] = self._within_reach(foot, landing, wanted)
            if waits:
                foot.later = (goal, place[2])
            else:
                foot.goal, foot.goal_z = goal, place[2]
        return taken

    def plan_step(self, leg: int, place: complex, height: float, top: float) -> bool:
        """Tell a standing foot where its next swing goes, over rough ground.

        Args:
            leg: index.
            place: x + iy, m in the world of the virtual pose.
            height: m, there.
            top: m, highest point of the swing.

        Returns:
            False where the foot is in the air, or a number is not finite.
        """
        foot = self.state.feet[leg]
        numbers = (place.real, place.imag, height, top)
        if foot.swinging or foot.turning or not all(map(math.isfinite, numbers)):
            return False
        foot.goal, foot.goal_z, foot.top = place, height, max(top, height, foot.z)
        return True

    def forget_steps(self, level: float) -> None:
        """Take back what standing feet were told, and count all heights from another level, m."""
        for foot in self.state.feet:
            foot.z, foot.start_z, foot.goal_z = foot.z - level, foot.start_z - level, foot.goal_z - level
            if foot.top is not None:
                foot.top -= level
            if not foot.swinging:
                foot.goal = foot.top = None

    def touch_down(self, leg: int) -> None:
        """End a swing here and now: the foot has met the ground."""
        foot = self.state.feet[leg]
        foot.anchor = self.state.pose.to_world(foot.local)
        foot.goal = foot.top = None
        foot.velocity = 0j
        foot.swinging = False

    def set_height(self, leg: int, height: float) -> None:
        """Correct the height of a standing foot, m over the plane of b'."""
        self.state.feet[leg].z = height

    def _within_reach(self, foot: Foot, landing: VirtualPose, wanted: complex) -> tuple[complex, bool]:
        """A foothold in the world, drawn in to the foot's reach at `landing`, and whether it was in it."""
        reach = self.config.foothold.reach
        away = landing.to_local(wanted) - foot.nominal
        if abs(away) <= reach:
            return wanted, True
        return landing.to_world(foot.nominal + away * (reach / abs(away))), False

    def _accept(self, state: GaitState, inputs: GaitInputs) -> None:
        state.target = place_of(inputs.gait)
        if inputs.rough != state.rough:
            state.rough, state.read = inputs.rough, None
        if inputs.halt:
            state.wanted = state.velocity = 0j
            state.wanted_yaw_rate = state.yaw_rate = 0.0
            state.landing = state.walking
            state.wanted_shift = 0j
            return
        forward, left = float(inputs.velocity[0]), float(inputs.velocity[1])
        if math.isfinite(forward) and math.isfinite(left):
            velocity = complex(forward, left)
            state.wanted = velocity if abs(velocity) > self.config.still_speed else 0j
        if math.isfinite(inputs.yaw_rate):
            rate = float(inputs.yaw_rate)
            state.wanted_yaw_rate = rate if abs(rate) > self.config.still_speed else 0.0
        state.wanted_shift = self._bounded_shift(inputs.foothold_shift)

    def _bounded_shift(self, wanted: FloatArray | None) -> complex:
        """A wanted shift of landing places, cut to its bound; one that is not finite is none."""
        if wanted is None:
            return 0j
        shift = complex(float(wanted[0]), float(wanted[1]))
        size, limit = abs(shift), self.config.foothold.shift_limit
        if not math.isfinite(size):
            return 0j
        return shift * (limit / size) if size > limit else shift

    def _reflex(
        self,
        state: GaitState,
        inputs: GaitInputs,
        contact: list[bool],
    ) -> ReflexOutput:
        if not self.config.reflex.enabled:
            return IDLE
        error: list[float] = np.asarray(inputs.tilt_rate_error, dtype=float).tolist()
        if not all(map(math.isfinite, error)) or is_quiet(error, self.config.reflex):
            return IDLE
        estimates = _estimates(inputs.foot_position)
        if estimates is None:
            places = [foot.in_b(state.pose) for foot in state.feet]
        else:
            places = [place for place, _ in estimates]
        trunk_x, trunk_y, _ = inputs.trunk_position.tolist()
        trunk = complex(trunk_x, trunk_y)
        return reflex(error, [place - trunk for place in places], contact, self.config.reflex)

    def _check_contacts(
        self,
        state: GaitState,
        contact: list[bool],
        estimates: list[tuple[complex, float]] | None,
        stride: Stride,
    ) -> None:
        for leg, foot in enumerate(state.feet):
            if foot.swinging:
                progress = state.rhythm.progress(state.cpg.y1[leg], state.cpg.y2[leg])[1]
                estimate = None if estimates is None else estimates[leg]
                height = None if estimate is None else estimate[1]
                if early_contact(foot, contact[leg], progress, height, self.config.foothold):
                    freeze(foot, estimate, stride, self.config.foothold)

    def _output(self, state: GaitState) -> GaitOutput:
        rhythm, (y1, y2), pose, share = state.rhythm, state.cpg, state.pose, state.rhythm.share
        phase: list[float] = []
        progress: list[float] = []
        rows: list[float] = []
        heights: list[float] = []
        for leg, foot in enumerate(state.feet):
            swing, part = rhythm.progress(y1[leg], y2[leg])
            phase.append((share * part if swing else share + (1.0 - share) * part) % 1.0)
            progress.append(part if swing else 0.0)
            place = foot.in_b(pose)
            rows += (place.real, place.imag, foot.z)
            heights.append(foot.z)
        centre, velocity = pose.centre, state.velocity
        numbers: list[float] = [*y1, *y2, *phase, *rows, *heights, *progress]
        numbers += (centre.real, centre.imag, pose.yaw, velocity.real, velocity.imag)
        values = np.array(numbers)  # one for all: making a small array costs more than a view
        return GaitOutput(
            phase=GaitPhase(
                swing=np.array([foot.swinging for foot in state.feet]),
                y1=values[0:4],
                y2=values[4:8],
                phase=values[8:12],
                walking=state.walking,
            ),
            foot_position=values[12:24].reshape(4, 3),
            foot_height=values[24:28],
            swing_progress=values[28:32],
            virtual_pose=values[32:35],
            place=state.place,
            velocity=values[35:37],
            yaw_rate=state.yaw_rate,
            cycle_time=state.cycle,
            swing_share=share,
            style=state.style,
            rough=state.rough,
        )


def _estimates(feet: FloatArray | None) -> list[tuple[complex, float]] | None:
    """Feet as (x + iy, z), or None when any is unknown."""
    if feet is None:
        return None
    rows: list[list[float]] = np.asarray(feet, dtype=float).tolist()
    if not all(math.isfinite(value) for row in rows for value in row):
        return None
    return [(complex(x, y), z) for x, y, z in rows]
