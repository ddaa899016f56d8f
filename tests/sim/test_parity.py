"""Pinocchio and MuJoCo agree on the robot, and the comparison sees it when they do not."""

from __future__ import annotations

import dataclasses
import re

import mujoco
import numpy as np
import pytest

from bluefoot_mpc.model.dynamics import Dynamics
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.model.robot import RobotModel, load_robot
from bluefoot_mpc.sim.parity import (
    ParityReport,
    check_parity,
    mujoco_model,
    mujoco_terms,
    pinocchio_terms,
    random_state,
    relative_errors,
)

QUANTITIES = {"mass", "com", "foot_positions", "mass_matrix", "bias", "gravity", "foot_jacobians"}


@pytest.mark.parametrize("name", ["bluefoot", "bluefoot_large"])
def test_engines_agree_at_a_thousand_random_states(name: str) -> None:
    report = check_parity(load_parameters(name), n=1000, seed=0)
    assert set(report.errors) == QUANTITIES
    assert report.agree, report.errors
    assert report.worst <= 1e-12
    assert report.states == 1000


def test_reported_mass_lies_in_the_documents_range() -> None:
    assert 1.85 <= check_parity(load_parameters(), n=1).mass <= 1.98


def test_same_seed_gives_the_same_report() -> None:
    parameters = load_parameters()
    assert check_parity(parameters, n=5, seed=3) == check_parity(parameters, n=5, seed=3)
    assert check_parity(parameters, n=5, seed=3) != check_parity(parameters, n=5, seed=4)


def test_engines_agree_on_a_lopsided_robot() -> None:
    """Products of inertia and a centre off every axis, which the real robot's symmetry hides."""
    parameters = load_parameters()
    lopsided = tuple(
        dataclasses.replace(
            p, position=(p.position[0] + 0.01, p.position[1] + 0.02 * p.mass, p.position[2] - 0.013)
        )
        for p in parameters.parts
    )
    report = check_parity(dataclasses.replace(parameters, parts=lopsided), n=50)
    assert report.agree, report.errors


@pytest.mark.parametrize(
    ("pattern", "replacement", "seen_in"),
    [
        # one link's mass, one product of inertia, one joint axis, gravity
        (r'("RR_link4">.*?<mass value=")[\d.]+', r"\g<1>0.0150001", {"mass", "com", "mass_matrix"}),
        (r'("trunk">.*?ixz=")[-\d.]+', r"\g<1>-0.000818", {"mass_matrix", "bias"}),
        (r'("FR_knee".*?<axis xyz=")0 -1 0', r"\g<1>0 1 0", {"foot_positions", "foot_jacobians"}),
        (r"-9\.80665", "-9.81", {"gravity", "bias"}),
    ],
)  # fmt: skip
def test_a_difference_is_found_and_named(pattern: str, replacement: str, seen_in: set[str]) -> None:
    robot = load_robot()
    changed, count = re.subn(pattern, replacement, robot.urdf, count=1, flags=re.DOTALL)
    assert count == 1
    model = mujoco_model(changed)
    q, v = random_state(robot, np.random.default_rng(0))
    actual = mujoco_terms(model, mujoco.MjData(model), q, v)
    errors = relative_errors(actual, pinocchio_terms(Dynamics(robot), q, v))
    assert {name for name, error in errors.items() if error > 1e-10} >= seen_in
    assert not ParityReport(states=1, mass=1.9, errors=errors).agree


def test_nan_is_no_agreement() -> None:
    robot: RobotModel = load_robot()
    q, v = random_state(robot, np.random.default_rng(0))
    expected = pinocchio_terms(Dynamics(robot), q, v)
    errors = relative_errors({**expected, "com": np.full(3, np.nan)}, expected)
    assert not ParityReport(states=1, mass=1.9, errors=errors).agree
    assert errors["bias"] == 0.0
