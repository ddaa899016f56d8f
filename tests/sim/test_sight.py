"""Scans and pictures in the frames of the simulated robot."""

import numpy as np
import pytest

from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.sim.config import PushConfig, SimConfig, WorldConfig
from bluefoot_mpc.sim.lidar import RaycastLidar
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.sim.sight_config import CameraConfig, LidarConfig
from bluefoot_mpc.types import JointCommand, SensorFrame
from tests.graphics import needs_graphics
from tests.runtime.made_up_run import same

CAMERA = CameraConfig(enabled=True, width=64, height=48)
LIDAR = LidarConfig(enabled=True)
CALM = 0.1
"""s of settling: enough for tests of who looks when."""


@pytest.fixture(scope="module")
def robot():
    return load_robot()


def standing(robot):
    return JointCommand(position=robot.stance_joints, speed=np.zeros(16), torque_limit=np.ones(16))


def live(robot, config, steps, seed=0):
    simulator = SimRobot(robot, config, seed)
    frames = [simulator._frame]
    frames += [simulator.step(standing(robot)) for _ in range(steps)]
    simulator.close()
    return frames


def scans(frames):
    return [(frame.time, frame.lidar) for frame in frames if frame.lidar is not None]


def pictures(frames):
    return [(frame.time, frame.camera) for frame in frames if frame.camera is not None]


def test_a_scan_every_tenth_of_a_second(robot):
    frames = live(robot, SimConfig(lidar=LIDAR, world=WorldConfig(name="room"), settle_time=CALM), 50)
    found = scans(frames)
    np.testing.assert_allclose([time for time, _ in found], 0.1 * np.arange(11), atol=1e-9)
    for time, scan in found:
        assert scan.time == pytest.approx(time, abs=1e-9)
        assert scan.valid
        assert scan.distance.shape == scan.bearing.shape == (682,)
        assert scan.bearing is found[0][1].bearing
        assert np.nanmin(scan.distance) >= 0.02
        assert np.nanmax(scan.distance) <= 5.6 + 1e-9
        # As the driver of a real sensor gives them: whole millimetres.
        np.testing.assert_allclose(1000 * scan.distance, np.rint(1000 * scan.distance), atol=1e-9)
    assert (found[1][1].distance != found[2][1].distance).any()
    assert not pictures(frames)


def test_a_period_that_does_not_fit_gets_the_scan_of_its_own_instant(robot, monkeypatch):
    """Frames every 30 ms: the sweep ends in between, and the frame after it brings what was seen then."""
    seen = {}
    measure = RaycastLidar.measure

    def watched(self, time):
        seen[time] = (self._data.qpos.copy(), self._data.xpos[self._trunk].copy())
        return measure(self, time)

    monkeypatch.setattr(RaycastLidar, "measure", watched)
    config = SimConfig(
        lidar=LIDAR, command_period=0.03, settle_time=0.09, pushes=(PushConfig(time=0.02, impulse=0.3),)
    )
    found = scans(live(robot, config, 20))
    np.testing.assert_allclose(
        [time for time, _ in found], [0.0, 0.12, 0.21, 0.3, 0.42, 0.51, 0.6], atol=1e-9
    )
    np.testing.assert_allclose([scan.time for _, scan in found], 0.1 * np.arange(7), atol=1e-9)
    # The trunk is where the state of that step has it, not where the step before had it.
    for state, trunk in seen.values():
        np.testing.assert_array_equal(state[:3], trunk)


@needs_graphics
@pytest.mark.parametrize("rate", [10.0, 30.0, 7.0])
def test_pictures_come_at_their_rate_and_a_period_late(robot, rate):
    config = SimConfig(camera=CameraConfig(enabled=True, width=64, height=48, rate=rate), settle_time=CALM)
    found = pictures(live(robot, config, 60))
    exposed = np.array([image.time for _, image in found])
    arrived = np.array([time for time, _ in found])
    np.testing.assert_allclose(exposed, np.round(np.arange(len(found)) / rate, 3), atol=1e-9)
    # They wait for the next frame: the delay is one period, and up to 20 ms more.
    late = arrived - exposed - 1.0 / rate
    assert (late > -0.001).all()
    assert (late < 0.020).all()
    assert len(found) == pytest.approx(1.2 * rate, abs=1.1)


@needs_graphics
def test_a_picture_shows_the_world_at_its_exposure(robot):
    """The robot is pushed away after the exposure: the picture is the one from before."""
    world = WorldConfig(name="room")
    still = SimConfig(camera=CAMERA, world=world, settle_time=CALM)
    pushed = SimConfig(
        camera=CAMERA,
        world=world,
        settle_time=CALM,
        pushes=(PushConfig(time=0.11, impulse=1.0, direction_deg=90.0),),
    )
    calm, moved = (pictures(live(robot, config, 16)) for config in (still, pushed))
    for k in (0, 1):
        np.testing.assert_array_equal(calm[k][1].pixels, moved[k][1].pixels)
    assert (calm[2][1].pixels != moved[2][1].pixels).any()


@needs_graphics
def test_reset_begins_anew_bit_for_bit(robot):
    config = SimConfig(lidar=LIDAR, camera=CAMERA, world=WorldConfig(name="room"), settle_time=CALM)
    simulator = SimRobot(robot, config, 4)

    def run() -> list[SensorFrame]:
        return [simulator.reset(), *(simulator.step(standing(robot)) for _ in range(14))]

    first, again = run(), run()
    assert all(map(same, first, again))
    assert len(scans(first)) == 3
    assert len(pictures(first)) == 2
    assert all(map(same, first, live(robot, config, 14, seed=4)))
    assert not all(map(same, first, live(robot, config, 14, seed=5)))
    simulator.close()
    simulator.close()


@needs_graphics
def test_looking_changes_nothing_else(robot):
    """Runs with and without sensors for the surroundings are equal in everything else."""
    blind = live(robot, SimConfig(settle_time=CALM), 12, seed=1)
    seeing = live(robot, SimConfig(settle_time=CALM, lidar=LIDAR, camera=CAMERA), 12, seed=1)
    assert len(scans(seeing)) == 3
    for one, other in zip(blind, seeing, strict=True):
        assert one.lidar is None
        assert one.camera is None
        for name in set(SensorFrame.__dataclass_fields__) - {"lidar", "camera"}:
            assert same(getattr(one, name), getattr(other, name)), name


def test_without_sensors_nobody_looks(robot):
    simulator = SimRobot(robot, SimConfig(settle_time=CALM))
    simulator.step(standing(robot))
    assert simulator._sight.due > 1 << 60
    assert not simulator._sight.has_news
