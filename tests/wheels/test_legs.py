import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.wheels.legs import (
    BIPED_STATES,
    LEAST_FEET_FOR_STATIC_STABILITY,
    LEG_FUNCTIONS,
    alternative_count,
    biped_sequences,
    contact_states,
    event_count,
    humanoid_freedom,
    stability_margin,
    statically_stable,
    support_polygon,
)

SQUARE = np.array([[0.2, 0.2], [0.2, -0.2], [-0.2, 0.2], [-0.2, -0.2]])


@pytest.mark.parametrize(
    ("legs", "todd", "other"),
    [(2, 6, 8), (4, 5_040, 512), (6, 39_916_800, 32_768), (8, 1_307_674_368_000, 2_097_152)],
)
def test_the_documents_counts_of_gaits(legs, todd, other):
    assert event_count(legs) == todd
    assert alternative_count(legs) == other


def test_the_documents_four_states_and_six_sequences_of_a_biped():
    assert contact_states(2) == len(BIPED_STATES) == 4
    assert BIPED_STATES == {1: (True, True), 2: (False, True), 3: (True, False), 4: (False, False)}
    sequences = {sequence.states: sequence.name for sequence in biped_sequences()}
    assert len(sequences) == event_count(2)
    assert sequences == {
        (1, 2): "turning on the right leg",
        (1, 3): "turning on the left leg",
        (1, 4): "hopping with both legs",
        (2, 3): "walking or running",
        (2, 4): "hopping on the right leg",
        (3, 4): "hopping on the left leg",
    }
    for (a, b), name in sequences.items():
        common = [
            side
            for side in ("left", "right")
            if getattr(BIPED_STATES[a], side) or getattr(BIPED_STATES[b], side)
        ]
        if "on the" in name:
            assert name.split()[-2] in common


def test_a_humanoid_has_22_degrees_of_freedom_and_a_leg_two_to_four():
    assert humanoid_freedom() == 22
    assert LEG_FUNCTIONS[:2] == ("lift", "swing")
    assert LEG_FUNCTIONS.index("position") + 1 == 3
    assert len(LEG_FUNCTIONS) == 4


@pytest.mark.parametrize("legs", [0, -2, 1.5, True, "4"])
def test_counts_of_no_legs_are_refused(legs):
    for count in (event_count, alternative_count, contact_states):
        with pytest.raises(ConfigurationError, match="whole number"):
            count(legs)


def test_margin_of_a_square_stance():
    assert stability_margin(SQUARE, np.zeros(2)) == pytest.approx(0.2)
    assert stability_margin(SQUARE, np.array([0.15, 0.0, 0.4])) == pytest.approx(0.05)
    assert stability_margin(SQUARE, np.array([0.3, 0.0])) == pytest.approx(-0.1)
    assert statically_stable(SQUARE, np.array([0.1, 0.1]))
    assert not statically_stable(SQUARE, np.array([0.1, 0.3]))


def test_three_feet_are_the_least_for_static_stability():
    down = np.array([True, True, True, False])
    inside = np.array([0.05, 0.05])
    assert down.sum() == LEAST_FEET_FOR_STATIC_STABILITY
    assert stability_margin(SQUARE, inside, down) == pytest.approx(0.1 / math.sqrt(2))
    two = np.array([True, False, False, True])
    assert stability_margin(SQUARE, np.zeros(2), two) == pytest.approx(0.0)
    assert stability_margin(SQUARE, inside, two) < 0.0
    assert not statically_stable(SQUARE, np.zeros(2), two)
    assert stability_margin(
        SQUARE, np.array([0.2, 0.3]), np.array([True, False, False, False])
    ) == pytest.approx(-0.1)


def test_no_foot_down_is_defined():
    assert stability_margin(SQUARE, np.zeros(2), np.zeros(4, dtype=bool)) == -math.inf
    assert support_polygon(SQUARE, np.zeros(4, dtype=bool)).shape == (0, 2)
    assert stability_margin(np.zeros((0, 2)), np.zeros(2)) == -math.inf


def test_a_foot_in_the_air_may_be_unknown_but_one_on_the_floor_may_not():
    feet = SQUARE.copy()
    feet[3] = np.nan
    assert stability_margin(feet, np.array([0.05, 0.05]), np.array([True, True, True, False])) > 0.0
    with pytest.raises(ConfigurationError, match="not finite"):
        stability_margin(feet, np.zeros(2))


@pytest.mark.parametrize(
    ("feet", "centre", "down", "words"),
    [
        (np.zeros(4), np.zeros(2), None, "feet"),
        (SQUARE, np.zeros(2), np.array([True]), "down"),
        (SQUARE, np.array([0.0]), None, "centre"),
        (SQUARE, np.array([0.0, np.nan]), None, "centre"),
    ],
)
def test_bad_stances_are_refused(feet, centre, down, words):
    with pytest.raises(ConfigurationError, match=words):
        stability_margin(feet, centre, down)
