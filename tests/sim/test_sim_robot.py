import hashlib
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bluefoot_mpc.exceptions import SimulationError
from bluefoot_mpc.geometry import rpy_from_quaternion
from bluefoot_mpc.io.robot import Robot
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.settings import build, to_table
from bluefoot_mpc.sim.config import PushConfig, RandomizationConfig, SensorConfig, SimConfig, WorldConfig
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.types import JointCommand

STANDARD = RandomizationConfig(preset="standard")


@pytest.fixture(scope="module")
def model():
    return load_robot()


def command(joints, limit=1.0, speed=0.0):
    return JointCommand(
        position=np.asarray(joints, dtype=float), speed=np.full(16, speed), torque_limit=np.full(16, limit)
    )


def marching(model, count):
    """Goals that lift diagonal pairs in turn: contacts, slip and changing loads."""
    for k in range(count):
        joints, phase = model.stance_joints.copy(), np.sin(2.0 * np.pi * k / 25)
        joints[[1, 13]] += 0.3 * max(0.0, phase)
        joints[[5, 9]] += 0.3 * max(0.0, -phase)
        yield command(joints)


def flat_bytes(value):
    if isinstance(value, np.ndarray):
        return value.tobytes()
    if hasattr(value, "__dataclass_fields__"):
        return b"".join(flat_bytes(getattr(value, name)) for name in value.__dataclass_fields__)
    return repr(value).encode()


def digest(robot, model, count=40, peek=True):
    sums = hashlib.sha256()
    for step in marching(model, count):
        sums.update(flat_bytes(robot.step(step)))
        if peek:
            robot.truth()
    sums.update(flat_bytes(robot.truth()))
    return sums.hexdigest()


def test_is_a_robot(model):
    assert isinstance(SimRobot(model, SimConfig()), Robot)


def test_two_runs_and_a_reset_are_bit_identical(model):
    config = SimConfig(randomization=STANDARD, pushes=(PushConfig(time=0.2, impulse=1.0),), backlash_deg=0.3)
    first, second = SimRobot(model, config, 7), SimRobot(model, config, 7)
    reference = digest(first, model)
    assert digest(second, model) == reference
    second.apply_push(np.array([3.0, 0.0, 0.0]), 0.5)
    second.step(command(model.stance_joints, limit=0.0))
    frame = second.reset()
    assert flat_bytes(frame) == flat_bytes(SimRobot(model, config, 7).reset())
    assert digest(second, model) == reference
    assert digest(SimRobot(model, config, 8), model) != reference


def test_reading_the_truth_changes_nothing(model):
    config = SimConfig()
    assert digest(SimRobot(model, config), model, peek=False) == digest(SimRobot(model, config), model)


def test_stands_still(model):
    robot = SimRobot(model, SimConfig())
    before = robot.truth()
    for _ in range(100):
        frame = robot.step(command(model.stance_joints))
    after = robot.truth()
    assert frame.time == pytest.approx(2.0)
    assert np.abs(after.q[:3] - before.q[:3]).max() < 1.5e-3
    assert np.abs(np.degrees(rpy_from_quaternion(after.q[3:7]))).max() < 0.2
    assert np.abs(after.foot_position - before.foot_position).max() < 1.5e-3
    assert np.abs(after.v).max() < 0.02
    assert after.touching == ()
    assert frame.contact.all()


def test_contact_forces_carry_the_weight_and_feet_give_little(model):
    robot = SimRobot(model, SimConfig())
    truth = robot.truth()
    weight = model.parameters.total_mass * 9.80665
    assert truth.foot_force[:, 2].sum() == pytest.approx(weight, rel=0.01)
    assert truth.foot_force[:, :2].sum(axis=0) == pytest.approx(np.zeros(2), abs=0.3)
    assert -2e-4 < truth.foot_height.min() < truth.foot_height.max() <= 0.0


def test_first_frame_has_the_samples_of_standing(model):
    frame = SimRobot(model, SimConfig()).reset()
    assert frame.time == 0.0
    assert frame.imu.time == pytest.approx([-0.015, -0.010, -0.005, 0.0])
    assert frame.contact.all()


@pytest.mark.parametrize("latency", [0.0, 0.013, 0.040])
def test_commands_arrive_after_the_latency(model, latency):
    rates = SimConfig(latency=latency, command_period=0.001, sensors=SensorConfig(imu_period=0.001))
    robot = SimRobot(model, rates)
    joints = model.stance_joints.copy()
    joints[1] += 0.4
    arrivals = []
    for k in range(60):
        robot.step(command(joints if k == 0 else model.stance_joints))
        arrivals.append(robot.truth().duty[1] > 0.5)
    assert np.argmax(arrivals) == round(latency * 1000)
    assert sum(arrivals) == 1


def test_several_commands_are_in_flight(model):
    robot = SimRobot(model, SimConfig(latency=0.040))
    goals = []
    for k in range(5):
        joints = model.stance_joints.copy()
        joints[0] = 0.1 * k
        robot.step(command(joints))
        goals.append(robot._bank.goal[0] * model.parameters.servo.step_angle)
    assert goals == pytest.approx([0.0, 0.0, 0.0, 0.1, 0.2], abs=0.003)


def test_push_changes_momentum_by_its_impulse(model):
    config = SimConfig(pushes=(PushConfig(time=0.1, impulse=0.4, direction_deg=90.0),))
    robot = SimRobot(model, config)
    limp = command(model.stance_joints)
    # In the air nothing but gravity and the push acts.
    robot.data.qpos[2] += 2.0
    for _ in range(5):
        robot.step(limp)
    before = robot.truth()
    for _ in range(5):
        robot.step(limp)
    after = robot.truth()
    change = after.momentum - before.momentum
    weight = model.parameters.total_mass * 9.80665
    assert change[:3] == pytest.approx([0.0, 0.4, -0.1 * weight], abs=1e-3)
    # On the trunk's origin, which lies below the centre of mass: r x F about x.
    assert change[3] == pytest.approx(0.4 * (before.com[2] - before.q[2]), rel=0.05)
    assert robot.step(limp).time == pytest.approx(0.22)
    assert not robot.truth().external_force.any()


def test_apply_push_lasts_as_long_as_asked(model):
    robot = SimRobot(model, SimConfig())
    robot.apply_push(np.array([2.0, 0.0, 0.0]), 0.030)
    robot.step(command(model.stance_joints))
    assert robot.truth().external_force.tolist() == [2.0, 0.0, 0.0]
    robot.step(command(model.stance_joints))
    assert not robot.truth().external_force.any()


def test_limp_robot_falls_on_its_trunk(model):
    robot = SimRobot(model, SimConfig())
    robot.stop()
    robot.stop()
    for _ in range(75):
        robot.step(command(model.stance_joints, limit=0.0))
    assert any(name == "trunk" or name.endswith("link3") for name in robot.truth().touching)
    robot.close()
    robot.close()


def test_stands_on_a_slope_aligned_with_it(model):
    robot = SimRobot(model, SimConfig(world=WorldConfig(name="slope", slope_deg=10.0)))
    for _ in range(50):
        robot.step(command(model.stance_joints))
    truth = robot.truth()
    # It climbs along +x, so the nose points up: negative pitch, and it sags downhill a little.
    assert np.degrees(rpy_from_quaternion(truth.q[3:7])) == pytest.approx([0.0, -10.0, 0.0], abs=1.0)
    assert truth.foot_position[0, 2] > truth.foot_position[2, 2]
    assert np.abs(truth.foot_height).max() < 3e-4
    assert truth.foot_force[:, 2].sum() == pytest.approx(model.parameters.total_mass * 9.80665, rel=0.02)


def test_slips_on_ice(model):
    robot = SimRobot(model, SimConfig(world=WorldConfig(slope_deg=10.0, friction=0.05)))
    for _ in range(50):
        robot.step(command(model.stance_joints))
    assert robot.truth().q[0] < -0.1


def test_not_finite_commands_are_discarded(model):
    robot = SimRobot(model, SimConfig())
    joints = model.stance_joints.copy()
    joints[3] = np.nan
    frame = robot.step(command(joints))
    assert robot.discarded_commands == 1
    assert np.isfinite(frame.joint_position).all()
    robot.reset()
    assert robot.discarded_commands == 0


def test_blown_up_physics_is_reported(model, tmp_path, monkeypatch):
    # MuJoCo notes the trouble in a file where it runs.
    monkeypatch.chdir(tmp_path)
    robot = SimRobot(model, SimConfig())
    robot.data.qvel[:] = np.nan
    with pytest.raises(SimulationError, match="unstable"):
        robot.step(command(model.stance_joints))


def test_reports_are_quantised(model):
    frame = SimRobot(model, SimConfig(randomization=STANDARD), 3).step(command(model.stance_joints))
    counts = frame.joint_position / model.parameters.servo.step_angle
    assert counts == pytest.approx(np.rint(counts), abs=1e-9)
    assert frame.voltage == round(frame.voltage, 1)
    assert (frame.joint_temperature == np.rint(frame.joint_temperature)).all()
    speed = frame.joint_speed / (0.111 * 2 * np.pi / 60)
    assert speed == pytest.approx(np.rint(speed), abs=1e-6)


def test_other_rates_work(model):
    robot = SimRobot(model, SimConfig(command_period=0.012))
    batches = [robot.step(command(model.stance_joints)).imu for _ in range(10)]
    assert {len(batch.time) for batch in batches} == {2, 3}
    assert np.concatenate([b.time for b in batches]) == pytest.approx(np.arange(1, 25) * 0.005)
    # Windows run on across frames: standing still measures gravity in every one.
    accel = np.vstack([batch.accel for batch in batches])
    assert np.abs(accel - [0.0, 0.0, 9.80665]).max() < 0.6


def test_truth_agrees_with_pinocchio(model):
    import pinocchio as pin

    robot = SimRobot(model, SimConfig(physics_period=0.001))
    for step in marching(model, 12):
        robot.step(step)
    truth = robot.truth()
    data = model.pin_model.createData()
    pin.computeCentroidalMomentum(model.pin_model, data, truth.q, truth.v)
    assert data.com[0] == pytest.approx(truth.com, abs=1e-9)
    assert data.hg.linear == pytest.approx(truth.momentum[:3], abs=1e-9)
    assert data.hg.angular == pytest.approx(truth.momentum[3:], abs=1e-9)
    pin.updateFramePlacements(model.pin_model, data)
    for leg, frame in enumerate(model.foot_frame_ids):
        assert data.oMf[frame].translation == pytest.approx(truth.foot_position[leg], abs=1e-9)


def test_payload_is_carried(model):
    robot = SimRobot(model, SimConfig(world=WorldConfig(payload=(0.3, 0.0, 0.0, 0.1))))
    weight = (model.parameters.total_mass + 0.3) * 9.80665
    assert robot.truth().foot_force[:, 2].sum() == pytest.approx(weight, rel=0.01)


def test_battery_sags_and_power_is_drawn(model):
    robot = SimRobot(model, SimConfig(voltage=11.4))
    robot.step(command(model.stance_joints))
    truth = robot.truth()
    assert 11.0 < truth.voltage < 11.4
    # Sixteen electronics at 50 mA are 9 W; holding the stance takes a few more.
    assert 9.0 < truth.electrical_power < 20.0


def test_configuration_survives_toml():
    config = SimConfig(
        world=WorldConfig(name="rough", payload=(0.1, 0.0, 0.0, 0.1)),
        randomization=STANDARD,
        pushes=(PushConfig(time=1.0, impulse=2.0),),
        backlash_deg=0.4,
    )
    assert build(SimConfig, to_table(config)) == config
    assert replace(config, backlash_deg=None) == build(
        SimConfig, to_table(replace(config, backlash_deg=None))
    )


def test_visual_shapes_are_kept_on_request_and_change_no_motion(model):
    bare, dressed = SimRobot(model, SimConfig()), SimRobot(model, SimConfig(visuals=True))
    assert dressed.model.ngeom > bare.model.ngeom + 50
    assert isinstance(dressed.data, mujoco.MjData)
    assert digest(bare, model, 10) == digest(dressed, model, 10)
