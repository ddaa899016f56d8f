import mujoco
import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, SimulationError
from bluefoot_mpc.model.library import LIBRARY, library_folder, load_library_robot
from bluefoot_mpc.sim.torque_robot import TorqueRobot, TorqueWorldConfig

# Joints stand in another order than Pinocchio's; the root is a dummy that no body can be; meshes are absent.
SMALL = """
<robot name="small">
  <material name="blue"><color rgba="0 0 1 1"/></material>
  <link name="root">
    <inertial><mass value="1e-6"/>
      <inertia ixx="1e-6" ixy="1e-6" ixz="1e-6" iyy="1e-6" iyz="1e-6" izz="1e-6"/></inertial>
  </link>
  <link name="trunk">
    <inertial><origin xyz="0.01 0 0.02"/><mass value="3"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.04"/></inertial>
    <visual><geometry><mesh filename="package://nowhere/trunk.dae"/></geometry></visual>
    <collision><geometry><mesh filename="package://nowhere/trunk.stl"/></geometry></collision>
  </link>
  <joint name="weld" type="fixed"><parent link="root"/><child link="trunk"/></joint>
  LEGS
</robot>
"""
LEG = """
  <link name="{n}_leg"><inertial><origin xyz="0 0 -0.1"/><mass value="0.4"/>
      <inertia ixx="0.002" ixy="0" ixz="0" iyy="0.002" iyz="0" izz="0.0005"/></inertial></link>
  <joint name="{n}_hip" type="revolute"><origin xyz="{x} {y} 0"/><parent link="trunk"/><child link="{n}_leg"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="{effort}" velocity="10"/></joint>
  <link name="{n}_foot"/>
  <joint name="{n}_mount" type="fixed"><origin xyz="0 0 -0.2"/>
    <parent link="{n}_leg"/><child link="{n}_foot"/></joint>
"""
LEGS = {"d": (0.2, 0.1, 5.0), "c": (0.2, -0.1, 6.0), "b": (-0.2, 0.1, 7.0), "a": (-0.2, -0.1, 0.0)}
FEET = ("d_foot", "c_foot", "b_foot", "a_foot")


@pytest.fixture(scope="module")
def urdf(tmp_path_factory):
    legs = "".join(LEG.format(n=n, x=x, y=y, effort=effort) for n, (x, y, effort) in LEGS.items())
    path = tmp_path_factory.mktemp("robot") / "small.urdf"
    path.write_text(SMALL.replace("LEGS", legs), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def pin_model(urdf):
    return pin.buildModelFromUrdf(str(urdf), pin.JointModelFreeFlyer())


@pytest.fixture
def robot(urdf, pin_model):
    return TorqueRobot(pin_model, urdf, FEET, standing(pin_model))


def standing(pin_model):
    q = np.array(pin.neutral(pin_model))
    q[2] = 0.22
    return q


def check_dynamics(urdf, pin_model, feet, start):
    """Free-flight accelerations of both engines, in a random state: signs, orders, frames, inertias."""
    rng = np.random.default_rng(3)
    q = np.array(pin.integrate(pin_model, start, rng.normal(size=pin_model.nv) * 0.2))
    q[2] = 5.0
    v, torque = rng.normal(size=pin_model.nv), rng.normal(size=pin_model.nv - 6)
    config = TorqueWorldConfig(physics_period=1e-6)
    robot = TorqueRobot(pin_model, urdf, feet, q, config)
    robot.data.qvel[:3] = pin.Quaternion(q[3:7]).toRotationMatrix() @ v[:3]
    robot.data.qvel[3:6] = v[3:6]
    for index, name in enumerate(list(pin_model.names)[2:]):
        robot.data.qvel[robot.model.joint(name).dofadr[0]] = v[6 + index]
    # Not at a stop, or its force would be in the way.
    assert np.all((pin_model.lowerPositionLimit[7:] < q[7:]) & (q[7:] < pin_model.upperPositionLimit[7:]))
    assert robot.q == pytest.approx(q, abs=1e-12)
    assert robot.v == pytest.approx(v, abs=1e-12)
    robot.step(torque, config.physics_period)
    wanted = pin.aba(pin_model, pin_model.createData(), q, v, np.concatenate([np.zeros(6), torque]))
    assert (robot.v - v) / config.physics_period == pytest.approx(wanted, abs=1e-3 * np.abs(wanted).max())


def test_dynamics_agree_with_pinocchio_in_any_order_of_joints(urdf, pin_model):
    assert [joint.lstrip("_")[0] for joint in list(pin_model.names)[2:]] == ["a", "b", "c", "d"]
    check_dynamics(urdf, pin_model, FEET, standing(pin_model))


@pytest.mark.parametrize("name", LIBRARY)
def test_dynamics_of_the_library_agree_with_pinocchio(name):
    try:
        library_folder()
    except ConfigurationError:
        pytest.skip("example-robot-data is not installed")
    robot = load_library_robot(name)
    check_dynamics(robot.urdf, robot.pin_model, robot.feet, robot.posture)


def test_feet_carry_the_weight_and_the_ground_pushes_up(robot, pin_model):
    for _ in range(300):  # straight legs: a stiff hold is enough
        robot.step(-20.0 * robot.q[7:] - 1.0 * robot.v[6:], 0.001)
    weight = pin.computeTotalMass(pin_model) * 9.81
    assert robot.foot_force.shape == (4, 3)
    assert robot.foot_force[:, 2].min() > 0.15 * weight
    assert robot.foot_force.sum(axis=0) == pytest.approx([0.0, 0.0, weight], abs=0.02 * weight)
    assert robot.q[2] == pytest.approx(0.22, abs=1e-3)
    assert robot.time == pytest.approx(0.3)
    # The front feet come first, as they were named; the mass lies towards them.
    assert robot.foot_force[:2, 2].sum() > robot.foot_force[2:, 2].sum()


def test_torques_reach_their_joints_and_stop_at_the_motors_limits(robot, pin_model):
    names = list(pin_model.names)[2:]
    torque = np.array([100.0 * (name != "a_hip") for name in names])  # a has no limit in the file
    robot.step(torque, 0.001)
    applied = dict(zip(names, robot.data.actuator_force, strict=True))
    assert applied == pytest.approx({"a_hip": 0.0, "b_hip": 7.0, "c_hip": 6.0, "d_hip": 5.0})
    robot.step(100.0 - torque, 0.001)
    assert robot.data.actuator_force[names.index("a_hip")] == pytest.approx(100.0)


def test_a_push_moves_the_trunk_and_then_stops(robot, pin_model):
    mass = pin.computeTotalMass(pin_model)
    robot.data.qpos[2] = 5.0  # in the air nothing else acts sideways
    robot.step(np.zeros(4), 0.001, np.array([0.0, 500.0 * mass, 0.0]))
    pushed = momentum(robot, pin_model)[1]
    assert pushed == pytest.approx(0.5 * mass, rel=1e-2)
    robot.step(np.zeros(4), 0.010)
    assert momentum(robot, pin_model)[1] == pytest.approx(pushed, rel=1e-2)


def momentum(robot, pin_model):
    data = pin_model.createData()
    pin.computeCentroidalMomentum(pin_model, data, robot.q, robot.v)
    return data.hg.linear


def test_reset_is_the_state_after_init_bit_for_bit(robot):
    first = (robot.q, robot.v, robot.foot_force)
    robot.step(np.ones(4), 0.005)
    after = (robot.q, robot.v, robot.foot_force)
    assert robot.q[7:] != pytest.approx(first[0][7:])
    robot.reset()
    assert all(np.array_equal(a, b) for a, b in zip((robot.q, robot.v, robot.foot_force), first, strict=True))
    robot.step(np.ones(4), 0.005)
    assert all(np.array_equal(a, b) for a, b in zip((robot.q, robot.v, robot.foot_force), after, strict=True))


def test_friction_and_ball_are_as_configured(urdf, pin_model):
    config = TorqueWorldConfig(friction=0.3, foot_radius=0.01)
    model = TorqueRobot(pin_model, urdf, FEET, standing(pin_model), config).model
    ball = model.geom("a_foot_ball")
    assert (ball.friction[0], ball.size[0]) == (0.3, 0.01)
    assert model.ngeom == 5  # floor and balls: looks and shapes of the file are gone
    assert model.opt.jacobian == mujoco.mjtJacobian.mjJAC_DENSE


def test_wrong_robots_are_refused_with_the_cause(urdf, pin_model, tmp_path):
    q = standing(pin_model)
    with pytest.raises(ConfigurationError, match="no link 'e_foot' for a foot; its links: a_foot, a_leg"):
        TorqueRobot(pin_model, urdf, (*FEET[:3], "e_foot"), q)
    with pytest.raises(ConfigurationError, match="at least one foot"):
        TorqueRobot(pin_model, urdf, (), q)
    with pytest.raises(ConfigurationError, match="cannot read the URDF"):
        TorqueRobot(pin_model, tmp_path / "none.urdf", FEET, q)
    with pytest.raises(ConfigurationError, match="11 numbers"):
        TorqueRobot(pin_model, urdf, FEET, q[:-1])
    (tmp_path / "two.urdf").write_text("<robot name='two'><link name='a'/><link name='b'/></robot>")
    with pytest.raises(ConfigurationError, match=r"one root link, not \['a', 'b'\]"):
        TorqueRobot(pin_model, tmp_path / "two.urdf", FEET, q)
    other = tmp_path / "other.urdf"
    other.write_text(urdf.read_text().replace("d_hip", "z_hip"))
    with pytest.raises(ConfigurationError, match="no joint 'd_hip'"):
        TorqueRobot(pin_model, other, FEET, q)


def test_garbage_torques_and_periods_are_refused(robot):
    with pytest.raises(SimulationError, match="not finite"):
        robot.step(np.array([0.0, np.nan, 0.0, 0.0]), 0.001)
    with pytest.raises(ConfigurationError, match="whole number of physics periods"):
        robot.step(np.zeros(4), 0.0015)
    with pytest.raises(ConfigurationError, match="foot_radius"):
        TorqueWorldConfig(foot_radius=0.0)
