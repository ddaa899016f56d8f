import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.iterative import IterativeConfig, Status, solve
from bluefoot_mpc.model.legs import LegGeometry, feet_in_base, foot_jacobians_in_base, inverse
from bluefoot_mpc.model.parameters import load_parameters

GEOMETRY = LegGeometry.from_parameters(load_parameters())
STANCE = np.radians([0.0, 9.11, -79.16, -28.95])


def foot(angles):
    return feet_in_base(GEOMETRY, angles, (0,))[0]


def foot_jacobian(angles):
    return foot_jacobians_in_base(GEOMETRY, angles, (0,))[0]


def foot_and_direction(angles):
    return np.append(foot(angles), angles[1:].sum())


def foot_and_direction_jacobian(angles):
    return np.vstack([foot_jacobian(angles), [0.0, 1.0, 1.0, 1.0]])


def random_angles(rng, count):
    return rng.uniform(GEOMETRY.lower[:4], GEOMETRY.upper[:4], size=(count, 4))


def test_any_foot_point_of_the_workspace_is_found_from_any_start():
    rng = np.random.default_rng(1)
    for wanted, start in zip(random_angles(rng, 60), random_angles(rng, 60), strict=True):
        result = solve(foot, foot_jacobian, foot(wanted), start)
        assert result.converged
        np.testing.assert_allclose(foot(result.q), foot(wanted), atol=1e-10)
        assert result.error <= 1e-10
        assert result.iterations <= 40


def test_with_the_ankle_direction_given_it_finds_the_closed_form():
    rng = np.random.default_rng(2)
    compared = 0
    for _ in range(60):
        target = foot(STANCE) + rng.uniform(-0.03, 0.03, 3)
        ankle = np.radians(-99.0) + rng.uniform(-0.2, 0.2)
        closed = inverse(GEOMETRY, target[None], ankle, legs=(0,))
        if not closed.reachable[0] or closed.joints[2] > -0.3:
            continue
        compared += 1
        result = solve(foot_and_direction, foot_and_direction_jacobian, np.append(target, ankle), STANCE)
        assert result.converged
        assert result.rank == 4
        np.testing.assert_allclose(result.q, closed.joints, atol=1e-8)
    assert compared > 30


def test_near_the_solution_it_converges_quadratically():
    target = foot(STANCE + np.array([0.02, -0.03, 0.02, 0.01]))
    assert solve(foot, foot_jacobian, target, STANCE).iterations <= 4


def test_singular_start_stalls_until_a_preferred_posture_shows_the_way():
    stretched = np.zeros(4)
    inward = np.array([-np.sqrt(0.5), -np.sqrt(0.5), 0.0])
    target = foot(stretched) + 0.05 * inward
    stuck = solve(foot, foot_jacobian, target, stretched)
    assert stuck.status is Status.STALLED
    assert stuck.rank == 2
    assert stuck.error == pytest.approx(0.05)
    free = solve(foot, foot_jacobian, target, stretched, preferred=STANCE)
    assert free.converged
    assert free.q[2] < 0.0  # the side of the preferred knee


def test_target_on_a_singular_posture_is_reached():
    for config in (IterativeConfig(tolerance=1e-8), IterativeConfig(tolerance=1e-8, damping=1e-3)):
        result = solve(foot, foot_jacobian, foot(np.zeros(4)), STANCE, config=config)
        assert result.error < 1e-6
        assert np.isfinite(result.q).all()


def test_out_of_reach_it_stalls_at_the_nearest_point():
    hip_pitch = GEOMETRY.hip_position[0] + 0.065 * np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)
    target = hip_pitch + np.array([0.2, 0.2, -0.25])
    result = solve(foot, foot_jacobian, target, STANCE)
    assert result.status is Status.STALLED
    assert result.error == pytest.approx(np.linalg.norm(target - hip_pitch) - 3 * 0.065, abs=1e-5)
    np.testing.assert_allclose(result.q[2:], 0.0, atol=0.02)


def test_preferred_posture_chooses_among_the_solutions():
    target = foot(STANCE)
    results = [
        solve(foot, foot_jacobian, target, np.radians([0.0, 20.0, -50.0, -60.0]), preferred=posture)
        for posture in (STANCE, np.radians([0.0, -10.0, -30.0, -85.0]))
    ]
    assert all(result.converged for result in results)
    assert results[0].q[3] - results[1].q[3] > 0.1


def test_iteration_limit_and_step_limit_are_kept():
    visited = []

    def watched(angles):
        visited.append(angles.copy())
        return foot(angles)

    config = IterativeConfig(max_iterations=3, max_step=0.01)
    target = foot(np.radians([30.0, 60.0, -20.0, 10.0]))
    result = solve(watched, foot_jacobian, target, STANCE, config=config)
    assert result.status is Status.ITERATION_LIMIT
    assert result.iterations == 3
    assert np.linalg.norm(result.q - STANCE) <= 0.03 + 1e-12
    assert max(np.linalg.norm(q - STANCE) for q in visited) <= 0.03 + 1e-12


def test_works_for_other_maps_and_residuals_are_reported():
    def forward(q):
        return np.array([np.exp(q[0]), q[0] + q[1] ** 3])

    def jacobian(q):
        return np.array([[np.exp(q[0]), 0.0], [1.0, 3.0 * q[1] ** 2]])

    result = solve(forward, jacobian, np.array([2.0, 1.0]), np.array([3.0, 2.0]))
    assert result.converged
    np.testing.assert_allclose(result.q, [np.log(2.0), np.cbrt(1.0 - np.log(2.0))], atol=1e-9)
    unreachable = solve(forward, jacobian, np.array([-1.0, 1.0]), np.array([0.5, 1.0]))
    assert not unreachable.converged
    np.testing.assert_allclose(unreachable.residual, np.array([-1.0, 1.0]) - forward(unreachable.q))


def test_a_solved_start_takes_no_step():
    result = solve(foot, foot_jacobian, foot(STANCE), STANCE)
    assert result.converged
    assert result.iterations == 0
    np.testing.assert_array_equal(result.q, STANCE)


def test_numbers_that_are_not_finite_are_refused():
    with pytest.raises(ConfigurationError, match="target of the iterative solver is not finite"):
        solve(foot, foot_jacobian, np.array([0.1, np.nan, 0.0]), STANCE)
    with pytest.raises(ConfigurationError, match="start of the iterative solver is not finite"):
        solve(foot, foot_jacobian, foot(STANCE), np.full(4, np.inf))
    with pytest.raises(ConfigurationError, match="max_step"):
        IterativeConfig(max_step=0.0)
