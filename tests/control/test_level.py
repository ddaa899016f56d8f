import math

import numpy as np
import pytest

from bluefoot_mpc.control.level import Centring, CentringConfig, is_trot
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.gait.gait import Gait, GaitConfig, GaitInputs, GaitOutput
from bluefoot_mpc.model.parameters import load_parameters

DT = 0.02
TILT_PER_METRE = 0.8


def centring(**changes) -> Centring:
    return Centring(CentringConfig(enabled=True, **changes))


def walk(gait: str = "trot", speed: float = 0.06):
    """A gait that walks on; call it for each tick's output."""
    made = Gait(GaitConfig(), load_parameters().stance.foot_position)
    inputs = GaitInputs(velocity=np.array([speed, 0.0]), gait=gait)
    return lambda: made.step(inputs, DT)


def tilt_of(load: np.ndarray, output: GaitOutput, lag: float = 0.0) -> np.ndarray:
    """(2,) rad, the tilt that a load off the centre by (2,) m makes, as the simulated robot showed it."""
    beat = math.cos(2.0 * math.pi * (float(output.phase.phase[0]) - lag) + math.radians(55.0))
    return TILT_PER_METRE * beat * np.array([load[0], -load[1]])


@pytest.mark.parametrize("load", [(0.006, 0.0), (0.0, 0.005), (-0.004, 0.007)])
@pytest.mark.parametrize("lag", [0.0, 0.08, -0.08])
def test_the_trunk_moves_until_the_load_is_centred(load, lag):
    law, step = centring(), walk()
    for _ in range(1000):
        output = step()
        law.step(tilt_of(np.array(load) + law.offset, output, lag), output, DT)
    np.testing.assert_allclose(law.offset, np.negative(load), atol=3e-4)


def test_a_tilt_that_does_not_follow_the_cycle_moves_little():
    law, step = centring(), walk()
    for _ in range(1000):
        output = step()
        twice = 0.004 * math.cos(4.0 * math.pi * float(output.phase.phase[0]))
        law.step(np.array([0.002 + twice, -0.003 + twice]), output, DT)
    assert np.abs(law.offset).max() < 1e-3


def test_the_shift_is_bounded():
    law, step = centring(bound=0.004), walk()
    for _ in range(1000):
        output = step()
        law.step(tilt_of(np.array([0.03, 0.03]), output), output, DT)
        assert np.abs(law.offset).max() <= 0.004
    np.testing.assert_allclose(np.abs(law.offset), 0.004, atol=5e-4)


def test_a_fast_trot_teaches_nothing():
    law, step = centring(slow=0.05, fast=0.1), walk(speed=0.3)
    while np.hypot(*(output := step()).velocity) < 0.1:
        pass
    for _ in range(100):
        law.step(tilt_of(np.array([0.006, 0.003]), output), output, DT)
        output = step()
    assert not law.offset.any()


def learnt() -> Centring:
    law, step = centring(), walk()
    for _ in range(100):
        output = step()
        law.step(tilt_of(np.array([0.006, 0.003]), output), output, DT)
    assert np.abs(law.offset).min() > 1e-4
    return law


def test_what_was_found_is_kept_where_there_is_no_trot():
    law = learnt()
    found = law.offset.copy()
    step = walk("walk", 0.03)
    for _ in range(200):
        law.step(np.array([0.01, 0.01]), step(), DT)
    standing = walk(speed=0.0)()
    assert not standing.phase.walking
    law.step(np.array([0.01, 0.01]), standing, DT)
    np.testing.assert_array_equal(law.offset, found)


@pytest.mark.parametrize("tilt", [(0.2, 0.0), (math.nan, 0.0), (0.0, math.inf)])
def test_pushes_and_unknown_tilts_tell_nothing(tilt):
    law, step = centring(), walk()
    for _ in range(20):
        law.step(np.array(tilt), step(), DT)
    assert not law.offset.any()


def test_switched_off_nothing_moves():
    law, step = Centring(CentringConfig()), walk()
    for _ in range(20):
        output = step()
        law.step(tilt_of(np.array([0.006, 0.003]), output), output, DT)
    assert not law.offset.any()


def test_reset_forgets_the_load():
    law = learnt()
    law.reset()
    assert not law.offset.any()


def test_trot_and_walk_are_told_apart():
    assert is_trot([0.98, 0.49, 0.51, 0.01])
    assert not is_trot([0.0, 0.5, 0.75, 0.25])
    assert not is_trot([0.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    "bad", [{"gain": -1.0}, {"max_tilt": 0.0}, {"bound": -0.1}, {"lead_deg": math.nan}, {"slow": 0.2}]
)
def test_impossible_values_are_refused(bad):
    with pytest.raises(ConfigurationError, match=next(iter(bad))):
        CentringConfig(**bad)
