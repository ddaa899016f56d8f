"""Puts the walk's footholds on mapped ground (thesis, chapter 6: planned footholds over terrain).

Maps are in the odometry frame, the gait's footholds in the world of its virtual
robot. The standing feet are known in both, which gives the shift between the
two: drift of either and the droop of soft servos fall out. Every tick one leg
that stands gets a new look at where it goes next; the nearest good ground in
reach, and a swing that clears what lies in between. Where there is none the
foot steps where it stands, and the robot waits.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, field

import numpy as np

from bluefoot_mpc.control.foot_contact import FootContacts, TouchConfig
from bluefoot_mpc.control.leg_reach import LegReach
from bluefoot_mpc.control.support import SupportConfig, SupportPlane
from bluefoot_mpc.gait.ahead import leg_phases
from bluefoot_mpc.gait.gait import Gait
from bluefoot_mpc.gait.virtual_robot import VirtualPose, carried
from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.legs import LegGeometry
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range
from bluefoot_mpc.terrain.footholds import ChoiceConfig, choose, height_around, highest_between
from bluefoot_mpc.terrain.ground import Ground
from bluefoot_mpc.types import LEGS, BodyState, BoolArray, FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class PlacerConfig:
    """How footholds are put on mapped ground."""

    choice: ChoiceConfig = field(default_factory=ChoiceConfig)
    touch: TouchConfig = field(default_factory=TouchConfig)
    support: SupportConfig = field(default_factory=SupportConfig)
    room: float = 0.07  # rad that legs keep to their limits where they land and lift
    sway: float = 0.020  # m that the trunk may be farther from a foot that lands or lifts
    inward: float = 0.040  # m inward of its place beside the trunk that a foot may stand
    clearance: float = 0.015  # m above all that a swing passes over
    least_lift: float = 0.020  # m above where a foot stands, and where it lands
    width: float = 0.036  # m, of the way that a swing must clear
    decided: float = 0.06  # s before lift-off, from which the choice stays
    follow: float = 0.3  # s, time constant of the shift between odometry and gait
    learn: float = 0.3  # share of a foot's miss by which its next goals are moved the other way
    learn_after: float = 0.1  # s after a landing, when its miss is measured
    learn_most: float = 0.012  # m, largest such move
    slow: float = 0.060  # m behind its place, from which a standing foot slows the walk
    stop: float = 0.085  # m behind its place, at which it stops it

    def __post_init__(self) -> None:
        """Check ranges."""
        require_nonnegative(
            room=self.room, sway=self.sway, inward=self.inward, clearance=self.clearance,
            least_lift=self.least_lift, decided=self.decided, slow=self.slow, learn_after=self.learn_after,
            learn_most=self.learn_most,
        )  # fmt: skip
        require_positive(follow=self.follow)
        require_range(self.slow + 1e-3, 1.0, stop=self.stop)
        require_range(0.0, 0.2, width=self.width)
        require_range(0.0, 1.0, learn=self.learn)


class FootPlacer:
    """Chooses footholds and swings for a gait on mapped ground.

    Attributes:
        footholds: (4, 3) m in the odometry frame, ground where the feet land next; NaN where none was chosen.
        lift: (4,) m that the next swings rise; NaN likewise.
        waiting: why a foot does not go on, in few words; empty while all do.
        support: plane that the trunk's height counts from, and how the trunk leans with it.
        pace: share of the commanded speed that the footholds allow.

    Args:
        geometry: legs.
        config: bounds.
    """

    def __init__(self, geometry: LegGeometry, config: PlacerConfig) -> None:
        self._config = config
        self._reach = LegReach(geometry)
        self._contacts = FootContacts(config.touch)
        self.support = SupportPlane(config.support)
        self.reset()

    def reset(self) -> None:
        """Forget the ground."""
        self._contacts.reset()
        self.support.reset()
        self._active = self._aligned = False
        self._turn, self._shift = 0.0, 0j  # odometry to the gait's world
        self._bias = [0j] * 4  # m, ahead and left, by which each foot misses its places on the whole
        self._landed = [math.inf] * 4  # s since it landed
        self._rise = math.nan  # m, heights of the gait over those of the map
        self._next = 0
        self.footholds = np.full((4, 3), np.nan)
        self.lift = np.full(4, np.nan)
        self._reasons = [""] * 4
        self.waiting = ""
        self._aim = np.full((4, 3), np.nan)  # where feet in the air go to
        self.pace = 1.0

    def step(self, ground: Ground | None, estimate: BodyState, gait: Gait, dt: float) -> None:
        """Take one tick's ground and estimate, before the gait advances.

        Args:
            ground: what to step on; None ends it.
            estimate: of the body.
            gait: whose next steps are planned (changed).
            dt: s.
        """
        if ground is None:
            if self._active:
                gait.forget_steps(self.support.level)
                self.reset()
            return
        if not estimate.healthy:
            return
        rotation = rotation_from_rpy(estimate.rpy)
        places = estimate.position + estimate.foot_position_in_base @ rotation.T
        self._contacts.step(gait, estimate.contact, places[:, 2], dt)
        self._learn(places, float(estimate.rpy[2]), gait, dt)
        self._align(ground, places, estimate.contact, gait, dt)
        self._active = True
        self._next = (self._next + 1) % 4
        self._plan(ground, places, gait, self._next)
        missed = (f"{LEGS[leg]}: it found no ground" for leg in np.flatnonzero(self._contacts.missing))
        self.waiting = next((reason for reason in (*self._reasons, *missed) if reason), "")
        self._follow_feet(gait, dt)

    def _learn(self, places: FloatArray, yaw: float, gait: Gait, dt: float) -> None:
        """Learn by how much each foot misses its places: soft legs do so much alike at every step."""
        config = self._config
        for leg, foot in enumerate(gait.state.feet):
            before = self._landed[leg]
            if foot.swinging:
                self._aim[leg] = self.footholds[leg]
            self._landed[leg] = 0.0 if foot.swinging else before + dt
            if not before < config.learn_after <= self._landed[leg]:
                continue
            x, y, _ = (places[leg] - self._aim[leg]).tolist()
            miss = complex(x, y) * cmath.rect(1.0, -yaw)
            if abs(miss) < 2.0 * config.learn_most:  # written so that no number is no lesson
                bias = self._bias[leg] + config.learn * miss
                self._bias[leg] = bias * min(1.0, config.learn_most / max(abs(bias), 1e-9))

    def _align(self, ground: Ground, places: FloatArray, contact: BoolArray, gait: Gait, dt: float) -> None:
        """Follow the shift between odometry and the gait's world by the standing feet."""
        feet = gait.state.feet
        standing = [leg for leg in range(4) if contact[leg] and not feet[leg].swinging]
        if len(standing) < 2:
            return
        seen = places[standing, 0] + 1j * places[standing, 1]
        told = np.array([feet[leg].anchor for leg in standing])
        turn = cmath.phase(complex(((told - told.mean()) * np.conj(seen - seen.mean())).sum()))
        share = 1.0 if not self._aligned else min(1.0, dt / self._config.follow)
        self._aligned = True
        middle = complex(seen.mean())
        self._turn += share * math.remainder(turn - self._turn, 2.0 * math.pi)
        shift = complex(told.mean()) - cmath.rect(1.0, self._turn) * middle
        self._shift += share * (shift - self._shift)
        rises = [feet[leg].z - height_around(ground, places[leg, :2]) for leg in standing]
        known = [rise for rise in rises if math.isfinite(rise)]
        if known:
            rise = sum(known) / len(known)
            self._rise = rise if math.isnan(self._rise) else self._rise + share * (rise - self._rise)

    def _to_gait(self, places: FloatArray) -> FloatArray:
        """(k, 3) places of the odometry frame in the gait's world."""
        moved = cmath.rect(1.0, self._turn) * (places[:, 0] + 1j * places[:, 1]) + self._shift
        return np.column_stack([moved.real, moved.imag, places[:, 2] + self._rise])

    def _from_gait(self, place: complex) -> FloatArray:
        """(2,) m in the odometry frame."""
        back = (place - self._shift) * cmath.rect(1.0, -self._turn)
        return np.array([back.real, back.imag])

    def _plan(self, ground: Ground, places: FloatArray, gait: Gait, leg: int) -> None:
        """Look anew where a standing leg goes next."""
        state, foot = gait.state, gait.state.feet[leg]
        if foot.swinging or foot.turning:
            return
        if math.isnan(self._rise):
            self._wait(gait, leg, "no foot stands on known ground")
            return
        phase = leg_phases(state)[leg] if state.walking else 0.5
        wait = (1.0 - phase) * state.cycle
        if foot.goal is not None and wait < self._config.decided and state.walking:
            return
        swing, stance = state.rhythm.share * state.cycle, (1.0 - state.rhythm.share) * state.cycle
        landing = state.pose.moved(state.velocity, state.yaw_rate, wait + swing)
        lifting = landing.moved(state.velocity, state.yaw_rate, stance)
        lead = foot.shape.stance_lead * stance
        nominal = landing.to_world(carried(foot.nominal, state.velocity, state.yaw_rate, lead))

        def holds(candidates: FloatArray) -> BoolArray:
            moved = self._to_gait(candidates)
            return self._held(gait, leg, moved, landing) & self._held(gait, leg, moved, lifting)

        last = self.footholds[leg, :2] if foot.goal is not None and not self._reasons[leg] else None
        choice = choose(ground, self._from_gait(nominal), holds, last, self._config.choice)
        if not choice.found:
            self._wait(gait, leg, choice.reason)
            return
        self._reasons[leg] = ""
        self.footholds[leg] = choice.place
        config = self._config
        goal = self._to_gait(choice.place[None])[0]
        bias = self._bias[leg] * cmath.rect(1.0, state.pose.yaw)
        high = highest_between(ground, places[leg, :2], choice.place[:2], config.width) + self._rise
        top = max(high + config.clearance, foot.z + config.least_lift, float(goal[2]) + config.least_lift)
        self.lift[leg] = top - foot.z
        gait.plan_step(leg, complex(goal[0], goal[1]) - bias, float(goal[2]), top)

    def _wait(self, gait: Gait, leg: int, reason: str) -> None:
        """Let a leg step where it stands."""
        foot, lift = gait.state.feet[leg], self._config.least_lift
        self._reasons[leg] = f"{LEGS[leg]}: {reason}"
        self.footholds[leg] = np.nan
        self.lift[leg] = lift
        gait.plan_step(leg, foot.anchor, foot.z, foot.z + lift)

    def _held(self, gait: Gait, leg: int, places: FloatArray, pose: VirtualPose) -> BoolArray:
        """(k,) whether the leg holds (k, 3) places of the gait's world with the virtual robot at `pose`."""
        local = (places[:, 0] + 1j * places[:, 1] - pose.centre) * cmath.rect(1.0, -pose.yaw)
        nominal, style = gait.state.feet[leg].nominal, gait.state.style
        # A foot far inward makes the support of its neighbours' steps thin.
        held = local.imag * math.copysign(1.0, nominal.imag) >= abs(nominal.imag) - self._config.inward
        sway = self._config.sway * nominal / abs(nominal)
        z = places[:, 2] - self.support.level - style.trunk_height
        roll, pitch = self.support.tilt.tolist()
        rotation_base_to_virtual = rotation_from_rpy(np.array([roll, pitch, 0.0]))
        # Near its hip a leg is folded as far as it goes, so both ways count.
        for aside in (sway, -sway):
            away = local - style.trunk_forward + aside
            feet = np.column_stack([away.real, away.imag, z]) @ rotation_base_to_virtual
            held &= self._reach.holds(leg, feet, self._config.room)
        return np.asarray(held)

    def _follow_feet(self, gait: Gait, dt: float) -> None:
        """The plane under the trunk, and how fast the walk may go on."""
        state, config = gait.state, self._config
        self.support.step(_supports(gait), dt, walking=state.walking)
        speed = abs(state.wanted) or abs(state.velocity)
        if speed == 0.0:
            self.pace = 1.0
            return
        along = (state.wanted or state.velocity) / speed
        behind = [
            -((foot.in_b(state.pose) - foot.nominal) * along.conjugate()).real
            for foot in state.feet if not foot.swinging
        ]  # fmt: skip
        worst = max(behind, default=0.0)
        self.pace = min(1.0, max(0.0, (config.stop - worst) / (config.stop - config.slow)))


def _supports(gait: Gait) -> FloatArray:
    """(4, 3) m in b', upwards in the gait's world: where each foot stands, or lands if it swings."""
    places = []
    for foot in gait.state.feet:
        place, z = foot.in_b(gait.state.pose), foot.z
        if foot.swinging and foot.goal is not None:
            place, z = gait.state.pose.to_local(foot.goal), foot.goal_z
        places.append((place.real, place.imag, z))
    return np.array(places)
