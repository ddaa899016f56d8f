import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.types import LEGS
from bluefoot_mpc.wheels.gaits import GAITS, HEXAPOD, Gait, feet_over_cycle, margin_over_cycle, wave

PHASE = np.linspace(0.0, 1.0, 240, endpoint=False)
QUADRUPED = np.array([[0.2, 0.15], [0.2, -0.15], [-0.2, 0.15], [-0.2, -0.15]])
SIX = np.array([[0.3, 0.2], [0.0, 0.25], [-0.3, 0.2], [0.3, -0.2], [0.0, -0.25], [-0.3, -0.2]])


def together(gait):
    """Sets of legs that land at the same moment, in order."""
    moments = sorted(set(gait.landing))
    return [
        {leg for leg, m in zip(gait.legs, gait.landing, strict=True) if m == moment} for moment in moments
    ]


@pytest.mark.parametrize("gait", GAITS.values(), ids=GAITS)
def test_diagram_states_and_samples_agree(gait):
    standing = gait.standing(PHASE + 1e-4)
    np.testing.assert_allclose(standing.mean(axis=0), gait.duty, atol=0.01)
    for leg in range(len(gait.legs)):
        bars = gait.intervals(leg)
        assert sum(end - start for start, end in bars) == pytest.approx(gait.duty)
        inside = np.any([(a <= PHASE + 1e-4) & (b > PHASE + 1e-4) for a, b in bars], axis=0)
        np.testing.assert_array_equal(inside, standing[:, leg])
    counts = standing.sum(axis=1)
    assert gait.support == (counts.min(), counts.max())
    for moment, pattern in gait.states():
        assert tuple(gait.standing(np.array([moment + 1e-4]))[0]) == pattern


def test_quadruped_gaits_have_their_footfall():
    assert together(GAITS["trot"]) == [{"FL", "RR"}, {"FR", "RL"}]
    assert together(GAITS["pace"]) == [{"FL", "RL"}, {"FR", "RR"}]
    assert together(GAITS["bound"]) == [{"RL", "RR"}, {"FL", "FR"}]
    assert together(GAITS["pronk"]) == [set(LEGS)]
    assert [leg for (leg,) in together(GAITS["walk"])] == ["RL", "FL", "RR", "FR"]  # lateral sequence
    assert [leg for (leg,) in together(GAITS["transverse gallop"])] == ["RL", "RR", "FL", "FR"]
    assert [leg for (leg,) in together(GAITS["rotary gallop"])] == ["RL", "RR", "FR", "FL"]


def test_hexapod_gaits_lift_three_two_and_one_leg_at_a_time():
    assert together(GAITS["tripod"]) == [{"L1", "L3", "R2"}, {"L2", "R1", "R3"}]
    assert [len(HEXAPOD) - GAITS[name].support[0] for name in ("tripod", "ripple", "wave")] == [3, 2, 1]


def test_a_runner_flies_and_a_walker_does_not():
    assert GAITS["biped run"].support == (0, 1)
    assert GAITS["biped walk"].support == (1, 2)


def test_six_legs_walk_in_static_stability_and_four_only_when_slow():
    """The document says six legs are needed: true at half the time in the air, not for a slow crawl."""
    least = {
        name: margin_over_cycle(GAITS[name], QUADRUPED, 0.1, PHASE).min()
        for name in ("trot", "walk", "crawl")
    }
    assert least["trot"] < -0.01
    assert least["walk"] == pytest.approx(0.0, abs=1e-6)  # duty 3/4 is the limit of four legs
    assert least["crawl"] > 0.002
    for name in ("tripod", "ripple", "wave"):
        assert margin_over_cycle(GAITS[name], SIX, 0.1, PHASE).min() > 0.1


def test_feet_on_the_floor_move_back_as_fast_as_the_trunk_moves_ahead():
    gait, stride = GAITS["walk"], 0.12
    phase = np.linspace(0.0, 1.0, 2000, endpoint=False)
    feet, down = feet_over_cycle(gait, QUADRUPED, stride, phase), gait.standing(phase)
    speed = np.diff(feet[:, :, 0], axis=0) / np.diff(phase)[:, None]
    both = down[1:] & down[:-1]
    np.testing.assert_allclose(speed[both], -stride, rtol=1e-6)
    np.testing.assert_allclose(np.mean(feet[:, :, 0], axis=0), QUADRUPED[:, 0], atol=1e-3)
    np.testing.assert_array_equal(feet[:, :, 1], np.repeat(QUADRUPED[None, :, 1], 2000, axis=0))


def test_centre_of_mass_shifts_the_margin():
    ahead = margin_over_cycle(GAITS["tripod"], SIX, 0.0, PHASE, np.array([0.5, 0.0]))
    assert ahead.max() < 0.0


@pytest.mark.parametrize(
    "changes", [{"legs": ()}, {"landing": (0.0,)}, {"duty": 0.0}, {"duty": 1.2}, {"landing": (0.0, np.nan)}]
)
def test_impossible_gaits_are_refused(changes):
    with pytest.raises(ConfigurationError):
        Gait(**({"name": "wrong", "legs": ("a", "b"), "duty": 0.5, "landing": (0.0, 0.5)} | changes))


def test_always_standing_is_a_gait_too():
    still = wave(1.0, "still")
    assert still.intervals(0) == [(0.0, 1.0)]
    assert still.support == (6, 6)
    assert len(still.states()) == 1
