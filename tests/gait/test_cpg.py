import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.gait.calibration import calibrate, measure
from bluefoot_mpc.gait.couplings import COUPLINGS, TROT, WALK, coupling, scaled
from bluefoot_mpc.gait.cpg import (
    CpgConfig,
    CpgInputs,
    CpgIntegrator,
    CpgState,
    advance,
    angle_fraction,
    derivative,
    on_circle,
    trajectory,
)
from bluefoot_mpc.gait.network import coming_to_rest
from bluefoot_mpc.gait.timing import GaitTiming, cycle_time, step_height, uncoupled_period

ALONE = (0.0,) * 16
SHARES = {"trot": 0.36, "walk": 0.22}


def lift_offs(y2: np.ndarray, dt: float) -> list[np.ndarray]:
    times = []
    for leg in range(4):
        a, b = y2[:-1, leg], y2[1:, leg]
        k = np.flatnonzero((a <= 0.0) & (b > 0.0))
        times.append((k + a[k] / (a[k] - b[k])) * dt)
    return times


def roll(state: CpgState, inputs: CpgInputs, dt: float, count: int, config: CpgConfig) -> np.ndarray:
    integrator = CpgIntegrator(config)
    states = np.empty((count, 8))
    for k in range(count):
        state = integrator.advance(state, inputs, dt)
        states[k] = (*state.y1, *state.y2)
    return states


def lags(y2: np.ndarray, dt: float, leader: int) -> np.ndarray:
    times = lift_offs(y2, dt)
    first, second = times[leader][-2:]
    return np.array([((t[-1] - first) / (second - first)) % 1.0 for t in times])


def circular(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs((np.asarray(a) - b + 0.5) % 1.0 - 0.5).max())


@pytest.mark.parametrize("psi_m", [1.0, 1.5])
@pytest.mark.parametrize("gamma", [1.0, 2.0])
def test_limit_cycle_radius(psi_m: float, gamma: float) -> None:
    config = CpgConfig(gamma=gamma)
    inputs = CpgInputs(omega=10.0, alpha=0.4, matrix=ALONE, psi_m=(psi_m,) * 4)
    start = CpgState(y1=(0.1, -2.0, 0.5, 1.0), y2=(0.0, 0.3, -0.7, 1.0))
    states = roll(start, inputs, 0.01, 300, config)
    radius = np.hypot(states[-50:, :4], states[-50:, 4:])
    np.testing.assert_allclose(radius, math.sqrt(gamma / psi_m), rtol=1e-4)


def test_printed_sign_is_unstable_and_ours_is_not() -> None:
    config = CpgConfig()
    inputs = CpgInputs(omega=10.0, alpha=0.4, matrix=ALONE)
    for radius, towards in ((0.9, 1.0), (1.1, -1.0)):
        y1 = [radius * math.cos(0.3)] * 4
        y2 = [radius * math.sin(0.3)] * 4
        rate1, rate2 = derivative(y1, y2, inputs, config)
        outward = (rate1[0] * y1[0] + rate2[0] * y2[0]) / radius
        assert outward * towards > 0.1
        # Only the radial term has an outward part, so the printed sign flips it:
        # small cycles die out, large ones run away.
        gain = config.convergence * inputs.omega
        assert outward == pytest.approx(-gain * (radius**2 - config.gamma) * radius)


def test_advance_follows_the_derivative() -> None:
    rng = np.random.default_rng(1)
    config = CpgConfig(steepness=20.0)
    dt = 1e-5
    for _ in range(10):
        y = rng.uniform(-1.2, 1.2, 8)
        inputs = CpgInputs(
            omega=float(rng.uniform(5.0, 40.0)),
            alpha=float(rng.uniform(0.1, 0.5)),
            matrix=tuple(rng.uniform(-0.2, 0.2, 16)),
            psi_omega=tuple(rng.uniform(1.0, 2.0, 4)),
            psi_m=tuple(rng.uniform(1.0, 2.0, 4)),
        )
        after = advance(CpgState(y1=tuple(y[:4]), y2=tuple(y[4:])), inputs, dt, config)
        before = advance(CpgState(y1=tuple(y[:4]), y2=tuple(y[4:])), inputs, -dt, config)
        difference = (np.array((*after.y1, *after.y2)) - np.array((*before.y1, *before.y2))) / (2.0 * dt)
        np.testing.assert_allclose(
            difference, np.concatenate(derivative(y[:4], y[4:], inputs, config)), rtol=1e-5, atol=1e-5
        )


def test_advance_is_pure() -> None:
    state = on_circle((0.0, 0.5, 0.5, 0.0), 0.3)
    inputs = CpgInputs(omega=20.0, alpha=0.3, matrix=TROT.matrix)
    first = advance(state, inputs, 0.01, CpgConfig())
    assert advance(state, inputs, 0.01, CpgConfig()) == first
    integrator = CpgIntegrator(CpgConfig())
    integrator.advance(first, inputs, 0.3)
    assert integrator.advance(state, inputs, 0.01) == first


@pytest.mark.parametrize("count", [1, 64, 65, 200])
def test_a_trajectory_is_what_single_steps_give(count: int) -> None:
    config, state = CpgConfig(), on_circle((0.0, 0.5, 0.4, 0.1), 0.3)
    inputs = CpgInputs(omega=7.0, alpha=0.3, matrix=scaled(WALK.matrix, 0.15), psi_m=(1.0, 1.2, 1.0, 1.1))
    states = trajectory(state, inputs, 0.02, count, config)
    np.testing.assert_array_equal(states, roll(state, inputs, 0.02, count, config))


@pytest.mark.parametrize("alpha", [0.2, 0.35, 0.5])
def test_uncoupled_share_and_period(alpha: float) -> None:
    config = CpgConfig(steepness=500.0, max_step=0.01)
    inputs = CpgInputs(omega=10.0, alpha=alpha, matrix=ALONE)
    states = roll(on_circle((0.9, 0.1, 0.5, 0.7), alpha), inputs, 1e-3, 8000, config)
    times = lift_offs(states[:, 4:], 1e-3)
    assert np.diff(times[0]).mean() == pytest.approx(uncoupled_period(10.0, alpha), rel=5e-3)
    whole = slice(round(times[0][0] / 1e-3), round(times[0][-1] / 1e-3))
    assert np.mean(states[whole, 4] <= 0.0) == pytest.approx(1.0 - alpha, abs=4e-3)


@pytest.mark.parametrize("name", COUPLINGS)
def test_calibrated_gait_has_the_wanted_share_and_period(name: str) -> None:
    gait, share, config = COUPLINGS[name], SHARES[name], CpgConfig()
    cycle = calibrate(gait, 0.15, share, config)
    period = 0.8
    rhythm = cycle.rhythm
    inputs = CpgInputs(omega=rhythm.turn / period, alpha=rhythm.alpha, matrix=rhythm.matrix)
    states = roll(cycle.start, inputs, 0.01, 800, config)
    for times, column in zip(lift_offs(states[:, 4:], 0.01), states[:, 4:].T, strict=True):
        assert np.diff(times)[-5:].mean() == pytest.approx(period, rel=0.02)
        whole = column[round(times[-4] / 0.01) : round(times[-1] / 0.01)]
        assert np.mean(whole > 0.0) == pytest.approx(share, abs=0.015)


def test_coupling_shifts_the_period_as_known() -> None:
    # At α = 0.35 (trot) and 0.25 (walk): +8 % and -27 %; and the walk's swings grow beyond α.
    trot = measure(TROT, 0.15, 0.35, CpgConfig())
    walk = measure(WALK, 0.15, 0.25, CpgConfig())
    assert trot is not None
    assert walk is not None
    assert trot.rhythm.turn / uncoupled_period(1.0, 0.35) == pytest.approx(1.07, abs=0.02)
    assert walk.rhythm.turn / uncoupled_period(1.0, 0.25) == pytest.approx(0.73, abs=0.02)
    assert walk.rhythm.share == pytest.approx(0.32, abs=0.01)


def test_unreachable_share_is_refused() -> None:
    with pytest.raises(ConfigurationError, match=r"swing_share = 0\.1 .*stalls"):
        calibrate(TROT, 0.4, 0.1, CpgConfig())


@pytest.mark.parametrize(("gait", "expected"), [(TROT, (0.0, 0.5, 0.5, 0.0)), (WALK, (0.5, 0.0, 0.25, 0.75))])
def test_random_states_lock_within_twenty_cycles(gait, expected) -> None:
    config = CpgConfig()
    rhythm = calibrate(gait, 0.15, SHARES[gait.name], config).rhythm
    inputs = CpgInputs(omega=1.0, alpha=rhythm.alpha, matrix=rhythm.matrix)
    dt = rhythm.turn / 60.0
    rng = np.random.default_rng(7)
    for _ in range(10):
        y = rng.uniform(-1.0, 1.0, 8)
        states = roll(CpgState(y1=tuple(y[:4]), y2=tuple(y[4:])), inputs, dt, 60 * 20, config)
        found = lags(states[:, 4:], dt, gait.leader)
        assert circular(found, expected) < 0.03
        if gait is WALK:
            assert np.argsort((found - found[1]) % 1.0).tolist() == [1, 2, 0, 3]  # FR, RL, FL, RR


def test_start_is_on_the_limit_cycle_at_the_first_lift_off() -> None:
    for gait in COUPLINGS.values():
        cycle = calibrate(gait, 0.15, SHARES[gait.name], CpgConfig())
        assert max(cycle.start.y2) == 0.0
        assert cycle.start.y2[gait.leader] == 0.0
        assert cycle.start.y1[gait.leader] < 0.0
        assert circular(cycle.rhythm.lag, gait.lag) < 0.03


def test_progress_is_linear_in_time() -> None:
    cycle = calibrate(TROT, 0.15, 0.36, CpgConfig())
    rhythm = cycle.rhythm
    inputs = CpgInputs(omega=rhythm.turn, alpha=rhythm.alpha, matrix=rhythm.matrix)  # period 1 s
    states = roll(cycle.start, inputs, 0.01, 100, CpgConfig())
    for k in range(100):
        time = 0.01 * (k + 1)
        swing, progress = rhythm.progress(states[k, 0], states[k, 4])
        expected = time / 0.36 if time < 0.36 else (time - 0.36) / 0.64
        if min(abs(time - 0.36), abs(time - 1.0)) > 0.011:
            assert swing == (time < 0.36)
            assert progress == pytest.approx(expected, abs=0.02)


def test_angle_fraction_ends() -> None:
    assert angle_fraction(-1.0, 1e-9) == (True, pytest.approx(0.0, abs=1e-6))
    assert angle_fraction(1.0, 1e-9) == (True, pytest.approx(1.0, abs=1e-6))
    assert angle_fraction(1.0, -1e-9) == (False, pytest.approx(0.0, abs=1e-6))
    assert angle_fraction(-1.0, -1e-9) == (False, pytest.approx(1.0, abs=1e-6))


def test_unknown_gait_names_the_valid_ones() -> None:
    with pytest.raises(ConfigurationError, match=r"unknown gait 'trott'.*trot, walk"):
        coupling("trott")


def test_timing_laws() -> None:
    timing = GaitTiming(swing_share=0.4, a_v=200.0, a_omega=10.0, cycle_min=0.4, cycle_max=1.2)
    assert cycle_time(0.1, 0.5, timing) == pytest.approx(math.pi / (25.0 * 0.24))
    assert cycle_time(0.0, 0.0, timing) == 1.2
    assert cycle_time(-0.001, 0.0, timing) == 1.2
    assert cycle_time(1.0, 0.0, timing) == 0.4
    heights = GaitTiming(height_v=0.2, height_omega=0.02, height_min=0.01, height_max=0.03)
    assert step_height(0.05, -0.5, heights) == pytest.approx(0.02)
    assert step_height(0.0, 0.0, heights) == 0.01
    assert step_height(0.5, 0.0, heights) == 0.03


@pytest.mark.parametrize(
    "values", [{"swing_share": 0.6}, {"cycle_min": 0.9}, {"a_v": -1.0}, {"height_min": 0.5}]
)
def test_impossible_timing_is_refused(values: dict[str, float]) -> None:
    with pytest.raises(ConfigurationError):
        GaitTiming(**values)


@pytest.mark.parametrize("phase", [0.02, 0.1, 0.2])
@pytest.mark.parametrize("gait", COUPLINGS)
def test_on_the_way_to_rest_a_leg_lands_in_its_own_time(gait: str, phase: float) -> None:
    """Uncoupled, the rest of a half turn takes what the oscillator alone needs for it."""
    config, alpha, omega = CpgConfig(), 0.3, 8.0
    state = on_circle((phase, 0.5, 0.6, 0.9), alpha)
    inputs = CpgInputs(omega=omega, alpha=alpha, matrix=scaled(COUPLINGS[gait].matrix, 0.15))
    time = 0.0
    while state.y2[0] > 0.0:
        before = state
        state = coming_to_rest(CpgIntegrator(config), state, inputs, 0.001)
        assert state.y2[1:] == before.y2[1:]
        time += 0.001
    assert time == pytest.approx((1.0 - phase / alpha) * math.pi / (omega * (1.0 - alpha)), abs=0.02)
