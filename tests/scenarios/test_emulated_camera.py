"""LIDAR and camera of the emulated robot, beside the simulated robot's."""

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.camera import CameraError
from bluefoot_mpc.io.clock import VirtualClock
from bluefoot_mpc.io.findings import Severity
from bluefoot_mpc.io.servo_robot.config import DevicesConfig
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.runtime.log import read_log
from bluefoot_mpc.runtime.replay import rethink
from bluefoot_mpc.scenarios import RunOptions, pipeline_from_log, run, runner
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.emulated import emulate
from bluefoot_mpc.scenarios.emulated_camera import EmulatedCamera
from bluefoot_mpc.scenarios.registry import SHIPPED
from bluefoot_mpc.sim.body import Posture
from bluefoot_mpc.sim.config import SimConfig, WorldConfig
from bluefoot_mpc.sim.plant import SimPlant
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.sim.sight_config import CameraConfig, LidarConfig
from tests.graphics import needs_graphics

pytestmark = [pytest.mark.slow, needs_graphics]

SMALL = CameraConfig(enabled=True, width=64, height=48)
SIGHT = ("sim.lidar.enabled=true", "sim.camera.enabled=true", "sim.camera.width=64", "sim.camera.height=48")


@pytest.fixture(scope="module")
def model():
    return load_robot()


@pytest.fixture(scope="module")
def stood(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    options = RunOptions(robot="emulator", duration=1.0, world="room", overrides=SIGHT, out=folder)
    return run("stand", options)


@pytest.fixture
def plant(model):
    height = float(model.default_stance()[2])
    return SimPlant(
        model, SimConfig(camera=SMALL, settle_time=0.05), Posture(joints=model.stance_joints, height=height)
    )


def test_frames_are_of_the_same_kind_as_the_simulated_robots(stood, model):
    log = read_log(stood.folder)
    emulated = [log.frame(k) for k in range(len(log.frames))]
    config = stood_config()
    simulator = SimRobot(model, config, 0)
    command = stood.data.commands[0].joints
    simulated = [simulator._frame, *(simulator.step(command) for _ in range(20))]
    for name in ("lidar", "camera"):
        one, other = (
            next(x for x in (getattr(f, name) for f in frames) if x is not None)
            for frames in (simulated, emulated)
        )
        assert type(one) is type(other)
        for field in type(one).__dataclass_fields__:
            a, b = getattr(one, field), getattr(other, field)
            assert type(a) is type(b)
            if isinstance(a, np.ndarray):
                assert (a.dtype, a.shape) == (b.dtype, b.shape)
    simulator.close()


def stood_config():
    return resolve(SHIPPED["stand"], RunOptions(world="room", overrides=SIGHT)).stages.sim


def test_ten_of_each_a_second(stood):
    log = read_log(stood.folder)
    frames = [log.frame(k) for k in range(len(log.frames))]
    scans = np.array([(f.time, f.lidar.time) for f in frames if f.lidar is not None])
    pictures = np.array([(f.time, f.camera.time) for f in frames if f.camera is not None])
    np.testing.assert_allclose(np.diff(pictures[:, 1]), 0.1, atol=1e-6)
    np.testing.assert_allclose(np.diff(scans[:, 1]), 0.1, atol=1e-3)
    # A picture comes a period after its exposure, a scan when its bytes have come through.
    assert ((pictures[:, 0] - pictures[:, 1] > 0.0999) & (pictures[:, 0] - pictures[:, 1] < 0.121)).all()
    assert ((scans[:, 0] > scans[:, 1]) & (scans[:, 0] < scans[:, 1] + 0.03)).all()


def test_the_run_can_be_thought_through_again(stood):
    log = read_log(stood.folder)

    def make_step():
        pipeline = pipeline_from_log(log, stood.folder)
        return lambda frame, motion, safety: pipeline.step(frame, motion, safety).command

    assert rethink(log, make_step).equal


def test_the_camera_keeps_the_newest_picture(plant):
    clock = VirtualClock()
    camera = EmulatedCamera(plant, clock)
    assert camera.take() is None
    assert camera.fault == "not started"
    assert camera.findings()[0].severity is Severity.WARNING
    camera.open()
    camera.open()
    assert camera.fault == ""
    assert camera.take() is None
    clock.sleep_until(0.45)
    image = camera.take()
    assert image.time == pytest.approx(0.3)
    assert camera.take() is None
    assert "gives pictures" in camera.findings()[0].text
    camera.close()
    camera.close()
    assert camera.fault == "closed"
    clock.sleep_until(0.65)
    plant.advance(0.65)
    assert camera.take() is None


def test_waiting_for_the_first_picture(plant):
    clock = VirtualClock()
    camera = EmulatedCamera(plant, clock)
    with pytest.raises(CameraError, match="no picture"):
        camera.start(timeout=0.05)
    camera.start(timeout=1.0)
    assert clock.now() == pytest.approx(0.1, abs=0.011)
    assert camera.take().time == 0.0
    camera.close()


def test_the_plants_clock_may_begin_anywhere(plant):
    clock = VirtualClock(start=7.0)
    plant.begin(7.0)
    camera = EmulatedCamera(plant, clock)
    camera.open()
    clock.sleep_until(7.25)
    assert camera.take().time == pytest.approx(7.1)
    camera.close()


def test_a_plant_without_a_camera_has_no_pictures(model):
    plant = SimPlant(model, SimConfig(settle_time=0.05), Posture(joints=model.stance_joints, height=0.12))
    plant.advance(0.3)
    assert plant.picture() is None


def test_no_pictures_come_through_ports():
    options = RunOptions(robot="emulator", link="pty", duration=1.0, overrides=("sim.camera.enabled=true",))
    with pytest.raises(ConfigurationError, match="--link pty"):
        runner._prepare(resolve(SHIPPED["stand"], options))


@pytest.mark.parametrize("switch", ["lidar", "devices"])
def test_the_emulated_lidar_has_the_simulations_errors(model, switch):
    errors = LidarConfig(enabled=switch == "lidar", dropouts=1.0)
    sim = SimConfig(lidar=errors, world=WorldConfig(name="room"), settle_time=0.05)
    posture = Posture(joints=model.stance_joints, height=0.12)
    parts = emulate(model, sim, posture, 0, DevicesConfig(emulate_lidar=switch == "devices"))
    assert parts.lidar is not None
    assert not np.any(parts.lidar._source.scan(0.1))
