"""The expressions against Pinocchio's own algorithms, on several robots."""

from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.model.symbolic import dynamics_function

ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
DATA = Path(pin.__file__).parents[4] / "share/example-robot-data/robots"
OTHERS = {
    "solo12": ("solo_description/robots/solo12.urdf", ("FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT")),
    "go2": ("go2_description/urdf/go2.urdf", ("FL_foot", "FR_foot", "RL_foot", "RR_foot")),
    "anymal": (
        "anymal_b_simple_description/robots/anymal.urdf",
        ("LF_FOOT", "RF_FOOT", "LH_FOOT", "RH_FOOT"),
    ),
}


def robot(name: str) -> tuple[pin.Model, tuple[int, ...]]:
    if name == "bluefoot":
        loaded = load_robot()
        return loaded.pin_model, loaded.foot_frame_ids
    if name == "random":
        # Joints about every axis, oblique placements, a tree that branches away from the base.
        model = pin.buildSampleModelHumanoidRandom()
        locked = [i for i in range(2, model.njoints) if model.joints[i].nv != 1]
        reduced = pin.buildReducedModel(model, locked, pin.neutral(model))
        frames = [f for f in range(reduced.nframes) if reduced.frames[f].parentJoint > 1]
        return reduced, tuple(frames[:: len(frames) // 4][:4])
    path, feet = OTHERS[name]
    if not (DATA / path).exists():
        pytest.skip("example-robot-data is not installed")
    model = pin.buildModelFromUrdf(str(DATA / path), pin.JointModelFreeFlyer())
    return model, tuple(model.getFrameId(foot) for foot in feet)


def random_state(model: pin.Model, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    quaternion = rng.normal(size=4)
    joints = rng.uniform(-1.5, 1.5, model.nq - 7)
    q = np.concatenate([rng.normal(size=3), quaternion / np.linalg.norm(quaternion), joints])
    return q, rng.normal(size=model.nv) * 2.0


@pytest.mark.parametrize("name", ["bluefoot", "random", *OTHERS])
def test_terms_are_pinocchios(name: str) -> None:
    model, frames = robot(name)
    armature = np.linspace(0.001, 0.01, model.nv - 6)
    function = dynamics_function(model, frames, list(armature))
    data, rng = model.createData(), np.random.default_rng(3)
    for _ in range(10):
        q, v = random_state(model, rng)
        found = {k: np.array(x) for k, x in function(q=q, v=v).items()}
        for key, value in expected(model, data, frames, q, v, armature).items():
            scale = max(1.0, np.abs(value).max())
            np.testing.assert_allclose(
                found[key].reshape(value.shape), value, rtol=0, atol=1e-12 * scale, err_msg=key
            )


def expected(model, data, frames, q, v, armature) -> dict[str, np.ndarray]:
    mass = np.array(pin.crba(model, data, q))
    mass = np.triu(mass) + np.triu(mass, 1).T + np.diag(np.concatenate([np.zeros(6), armature]))
    terms = {"M": mass, "h": np.array(pin.nonLinearEffects(model, data, q, v))}
    terms["com"] = np.array(pin.centerOfMass(model, data, q))
    terms["centroidal"] = np.array(pin.computeCentroidalMap(model, data, q))
    drift = pin.computeCentroidalMomentumTimeVariation(model, data, q, v, np.zeros(model.nv))
    terms["momentum_drift"] = np.array(drift.vector)
    pin.computeJointJacobians(model, data, q)
    pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
    pin.updateFramePlacements(model, data)
    terms["foot_position"] = np.array([data.oMf[f].translation for f in frames]).T
    terms["foot_jacobian"] = np.vstack([pin.getFrameJacobian(model, data, f, ALIGNED)[:3] for f in frames])
    drifts = [pin.getFrameClassicalAcceleration(model, data, f, ALIGNED).linear for f in frames]
    terms["foot_drift"] = np.array(drifts).T
    return terms


def test_legs_stay_apart() -> None:
    """The tree's structure shows in the expressions: no leg meets another one in the mass matrix."""
    model, frames = robot("bluefoot")
    function = dynamics_function(model, frames)
    q, v = ca.SX.sym("q", model.nq), ca.SX.sym("v", model.nv)
    block = function(q=q, v=v)["M"][6:10, 10:14]
    assert all(entry.is_zero() for entry in ca.vertsplit(ca.vec(block)))
    assert function.n_instructions() < 7000


def test_refuses_what_it_does_not_model() -> None:
    fixed = pin.buildSampleModelManipulator()
    with pytest.raises(ConfigurationError, match="free flyer"):
        dynamics_function(fixed, [])
    model = pin.Model()
    base = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "base")
    model.addJoint(base, pin.JointModelPX(), pin.SE3.Identity(), "slide")
    with pytest.raises(ConfigurationError, match=r"slide.*revolute"):
        dynamics_function(model, [])
