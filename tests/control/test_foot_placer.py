"""Footholds on mapped ground: what the placer tells the gait, and what legs and contacts allow."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.control.foot_contact import FootContacts, TouchConfig
from bluefoot_mpc.control.foot_placer import FootPlacer, PlacerConfig
from bluefoot_mpc.control.leg_reach import LegReach
from bluefoot_mpc.control.upright import UprightAnkles
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.gait.config import GaitConfig
from bluefoot_mpc.gait.gait import Gait, GaitInputs
from bluefoot_mpc.gait.parameters import Style
from bluefoot_mpc.model.legs import AnkleTable
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.terrain.ground import rate_ground
from bluefoot_mpc.types import BodyState, HeightMap

DT, HEIGHT = 0.02, 0.115
FEET = np.array([[0.158, 0.157, 0.0], [0.158, -0.157, 0.0], [-0.158, 0.157, 0.0], [-0.158, -0.157, 0.0]])


@pytest.fixture(scope="module")
def geometry():
    return load_robot().geometry


def ground(height=0.0, known=True):
    heights = np.full((100, 100), height if known else np.nan)
    return rate_ground(
        HeightMap(
            time=0.0, cell=0.01, pose=np.array([-0.5, -0.5, -0.008, 0.0]), height=heights,
            confidence=np.where(np.isfinite(heights), 1.0, 0.0),
        )
    )  # fmt: skip


def body(gait: Gait, shift=(0.0, 0.0), healthy=True) -> BodyState:
    """A body whose feet are where the gait has them, in an odometry frame that is shifted against it."""
    feet = [foot.in_b(gait.state.pose) for foot in gait.state.feet]
    places = np.array([[p.real, p.imag, f.z - HEIGHT] for p, f in zip(feet, gait.state.feet, strict=True)])
    centre = gait.state.pose.centre
    return BodyState(
        time=0.0, position=np.array([centre.real + shift[0], centre.imag + shift[1], HEIGHT]),
        quaternion=np.array([0.0, 0.0, 0.0, 1.0]), rpy=np.zeros(3), linear_velocity=np.zeros(3),
        angular_velocity=np.zeros(3), joint_position=np.zeros(16), joint_velocity=np.zeros(16),
        contact=np.array([not foot.swinging for foot in gait.state.feet]),
        foot_position_in_base=places, height=HEIGHT, healthy=healthy,
    )  # fmt: skip


def placed(geometry, map, shift=(0.0, 0.0), ticks=4):
    gait = Gait(GaitConfig(), FEET, Style(trunk_height=HEIGHT))
    placer = FootPlacer(geometry, PlacerConfig())
    for _ in range(ticks):
        placer.step(map, body(gait, shift), gait, DT)
    return gait, placer


def test_without_ground_nobody_is_told_anything(geometry):
    gait, placer = placed(geometry, None)
    assert all(foot.goal is None for foot in gait.state.feet)
    assert placer.pace == 1.0
    assert placer.support.level == 0.0


def test_places_of_the_map_are_met_however_the_odometry_is_shifted(geometry):
    gait, placer = placed(geometry, ground(), shift=(0.05, -0.03))
    for foot, place in zip(gait.state.feet, placer.footholds, strict=True):
        assert foot.goal == pytest.approx(complex(place[0] - 0.05, place[1] + 0.03))
        assert foot.goal_z == pytest.approx(0.0, abs=1e-9)
    assert not placer.waiting
    assert np.all(placer.lift >= PlacerConfig().least_lift)


def test_ahead_of_a_kerb_the_foot_goes_up(geometry):
    map = ground()
    heights = map.map.height.copy()
    heights[:, 68:] = 0.025
    kerb = rate_ground(replace(map.map, height=heights))
    gait, placer = placed(geometry, kerb)
    up = placer.footholds[:, 2] > 0.0
    for leg in np.flatnonzero(up):
        assert gait.state.feet[leg].goal_z == pytest.approx(0.025, abs=1e-6)
        assert placer.lift[leg] >= 0.025 + PlacerConfig().clearance
    assert not up[2:].any()


def test_unknown_ground_is_never_stepped_on(geometry):
    gait, placer = placed(geometry, ground())
    unknown = ground(known=False)
    for _ in range(8):
        placer.step(unknown, body(gait), gait, DT)
    assert placer.waiting
    assert np.isnan(placer.footholds).all()
    assert all(foot.goal == foot.anchor for foot in gait.state.feet)


def test_a_blind_estimate_plans_nothing(geometry):
    gait, placer = Gait(GaitConfig(), FEET), FootPlacer(geometry, PlacerConfig())
    placer.step(ground(), body(gait, healthy=False), gait, DT)
    assert all(foot.goal is None for foot in gait.state.feet)


def test_legs_hold_their_stance_but_not_what_is_far(geometry):
    reach = LegReach(geometry)
    stance = FEET[:1] - (0.0, 0.0, HEIGHT)
    assert reach.holds(0, stance, 0.1).all()
    assert not reach.holds(0, stance - (-0.2, 0.0, 0.0), 0.1).any()
    assert not reach.holds(0, stance - (0.0, 0.0, 0.2), 0.1).any()


def test_last_links_lean_less_where_joints_allow(geometry):
    upright, widest = UprightAnkles(geometry, np.radians(-110.0), np.radians(5.0)), AnkleTable(geometry)
    feet = FEET - (0.0, 0.0, 0.12)
    assert np.all(upright.directions(feet) > widest.directions(feet))
    assert np.all(upright.directions(feet) <= np.radians(-109.9))
    far = feet * (1.3, 1.3, 1.0)
    assert upright.directions(far) == pytest.approx(widest.directions(far), abs=np.radians(1.0))


def test_an_early_touch_lands_the_foot_and_a_late_one_is_searched_for():
    gait = Gait(GaitConfig(), FEET)
    contacts = FootContacts(TouchConfig())
    inputs = GaitInputs(velocity=np.array([0.02, 0.0]), gait="walk", rough=True)
    gait.step(inputs, DT)
    leg = next(leg for leg in range(4) if gait.state.feet[leg].swinging)
    free, all_touch = np.ones(4, dtype=bool), np.ones(4, dtype=bool)
    free[leg] = False
    height = np.zeros(4)
    for k in range(60):
        late = k > 22
        contacts.step(gait, all_touch if late else free, height, DT)
        if not gait.state.feet[leg].swinging:
            break
        gait.step(inputs, DT)
    assert not gait.state.feet[leg].swinging
    assert gait.state.feet[leg].z == pytest.approx(0.0, abs=1e-9)
    before = gait.state.feet[leg].z
    contacts.reset()
    gait.state.feet[leg].swinging = True
    contacts.step(gait, free, height, DT)
    gait.state.feet[leg].swinging = False
    for _ in range(20):
        contacts.step(gait, free, height, DT)
    assert before - gait.state.feet[leg].z == pytest.approx(TouchConfig().search_depth)
    assert contacts.missing[leg]


def test_where_no_foot_stands_on_known_ground_all_step_where_they_are_and_say_why(geometry):
    gait, placer = placed(geometry, ground(known=False), ticks=8)
    assert all(foot.goal == foot.anchor for foot in gait.state.feet)
    assert "no foot stands on known ground" in placer.waiting


def test_the_first_alignment_is_whole_also_when_feet_touched_late(geometry):
    gait, placer = Gait(GaitConfig(), FEET, Style(trunk_height=HEIGHT)), FootPlacer(geometry, PlacerConfig())
    late = replace(body(gait, (0.2, 0.0)), contact=np.zeros(4, dtype=bool))
    placer.step(ground(), late, gait, DT)
    for _ in range(4):
        placer.step(ground(), body(gait, (0.2, 0.0)), gait, DT)
    for foot, place in zip(gait.state.feet, placer.footholds, strict=True):
        assert foot.goal == pytest.approx(complex(place[0] - 0.2, place[1]), abs=1e-6)


@pytest.mark.parametrize(
    "wrong", [{"learn": math.nan}, {"learn": -5.0}, {"learn_most": math.nan}, {"learn_after": -1.0}]
)
def test_settings_that_mean_nothing_are_refused(wrong):
    with pytest.raises(ConfigurationError):
        PlacerConfig(**wrong)
