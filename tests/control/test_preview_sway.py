from itertools import pairwise

import numpy as np
import pytest

from bluefoot_mpc.control import posture
from bluefoot_mpc.control.leg_masses import LegMasses
from bluefoot_mpc.control.posture import PostureConfig
from bluefoot_mpc.control.presets import preset
from bluefoot_mpc.control.preview_sway import PreviewSway
from bluefoot_mpc.control.servo_map import ServoMapConfig
from bluefoot_mpc.gait.gait import Gait, GaitInputs
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.model.robot import load_robot

DT = 0.02


@pytest.fixture(scope="module")
def robot():
    return load_robot()


class Bench:
    """A gait whose trunk stands where the preview put it on the tick before."""

    def __init__(self, robot):
        config = preset("mpc")
        stance = posture.stance(robot.parameters.stance, PostureConfig())
        style = posture.style(stance, PostureConfig(), ServoMapConfig())
        self.gait = Gait(config.gait, stance.feet, style)
        self.masses, self.joints = LegMasses(robot.parameters), robot.stance_joints
        self.sway = PreviewSway(self.masses, config.preview, lambda pose: self.joints, self.gait.schedule)
        self.trunk = np.array([0.0, 0.0, stance.trunk_height])

    def run(self, seconds, velocity=(0.03, 0.0), yaw_rate=0.0, gait="walk"):
        for _ in range(round(seconds / DT)):
            inputs = GaitInputs(velocity=np.array(velocity), yaw_rate=yaw_rate, gait=gait)
            self.output = self.gait.step(inputs, DT)
            before = self.sway.offset
            self.zmp = self.sway.step(self.output, self.joints, self.trunk, DT)
            self.trunk = self.trunk + np.append(self.sway.offset - before, 0.0)
            yield self.sway.plan


@pytest.mark.parametrize("yaw_rate", [0.0, 0.2])
def test_the_trunk_puts_the_lumped_centre_of_mass_at_the_plan(robot, yaw_rate):
    bench = Bench(robot)
    for plan in bench.run(4.0, yaw_rate=yaw_rate):
        com = bench.trunk + bench.masses.com(bench.joints)
        np.testing.assert_allclose(com[:2], plan.start[0], atol=1e-12)
        np.testing.assert_allclose(bench.zmp, plan.start[0] - com[2] / GRAVITY * plan.start[2], atol=1e-12)


def test_the_planned_zmp_keeps_inside_the_feet_that_stand(robot):
    bench = Bench(robot)
    plans = list(bench.run(8.0))
    margins = np.array([plan.least_margin for plan in plans[100:]])
    assert margins.min() >= 0.005
    assert all(plan.status == 0 for plan in plans)


def test_successive_plans_go_on_from_each_other(robot):
    bench = Bench(robot)
    plans = list(bench.run(4.0, velocity=(0.0, 0.0)))  # b' stands still: plans are in one frame
    for before, after in pairwise(plans):
        np.testing.assert_allclose(before.at(DT), after.start, atol=1e-9)


@pytest.mark.parametrize("rate", [0.0, 1e-9, 0.3, -0.7])
def test_the_nominal_path_is_a_point_of_the_moving_frame(robot, rate):
    bench = Bench(robot)
    list(bench.run(3.0, velocity=(0.05, 0.02), yaw_rate=rate))
    gait, point = bench.output, np.array([0.02, -0.01])
    path, speed, turn = bench.sway._path(gait, point)
    # The twist integrated by small steps.
    steps, horizon = 20_000, bench.sway._ahead[-1]
    dt, velocity = horizon / steps, complex(*gait.velocity)
    headings = gait.yaw_rate * (np.arange(steps) + 0.5) * dt
    place = np.concatenate([[0j], np.cumsum(velocity * np.exp(1j * headings) * dt)])
    at = np.round(bench.sway._ahead / dt).astype(int)
    expected = place[at] + complex(*point) * np.exp(1j * gait.yaw_rate * bench.sway._ahead)
    np.testing.assert_allclose(path, np.column_stack([expected.real, expected.imag]), atol=1e-9)
    np.testing.assert_allclose(turn, gait.yaw_rate * bench.sway._ahead)
    middle = (path[2:] - path[:-2]) / (bench.sway._ahead[2:] - bench.sway._ahead[:-2])[:, None]
    np.testing.assert_allclose(speed[1:-1], middle, atol=2e-5)


def test_it_forgets_and_plans_the_same_again_bit_for_bit(robot):
    bench = Bench(robot)
    first = [plan.position for plan in bench.run(2.0)]
    bench.sway.reset()
    bench.gait.reset()
    bench.trunk[:2] = 0.0
    assert bench.sway.plan is None
    np.testing.assert_array_equal(bench.sway.offset, 0.0)
    for again, plan in zip(bench.run(2.0), first, strict=True):
        np.testing.assert_array_equal(again.position, plan)
