"""The generated URDF: masses, inertias, names, shapes, and what engines make of it."""

from __future__ import annotations

import dataclasses
import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np
import pytest

from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.inertia import compose, part_inertia
from bluefoot_mpc.model.parameters import Part, RobotParameters, load_parameters
from bluefoot_mpc.model.resources import models_folder
from bluefoot_mpc.model.shapes import MATERIALS
from bluefoot_mpc.model.urdf import make_urdf, write_urdf
from bluefoot_mpc.types import JOINTS, LEGS, FloatArray

ROBOTS = ["bluefoot", "bluefoot_large"]


@pytest.fixture(scope="module", params=ROBOTS)
def parameters(request: pytest.FixtureRequest) -> RobotParameters:
    return load_parameters(request.param)


@pytest.fixture(scope="module")
def root(parameters: RobotParameters) -> ET.Element:
    return ET.fromstring(make_urdf(parameters))


@pytest.fixture(scope="module")
def compiled(parameters: RobotParameters) -> mujoco.MjModel:
    spec = mujoco.MjSpec.from_string(make_urdf(parameters))
    spec.body("trunk").add_freejoint()
    return spec.compile()


def part(
    shape: str, size: tuple[float, ...], mass: float = 1.0, position: tuple[float, ...] = (0, 0, 0)
) -> Part:
    return Part(name="p", body="trunk", mass=mass, shape=shape, size=size, position=position)


def numbers(text: str | None) -> list[float]:
    return [float(word) for word in (text or "").split()]


def inertia_of(link: ET.Element) -> tuple[float, FloatArray, FloatArray]:
    entry = link.find("inertial/inertia").attrib
    xx, xy, xz, yy, yz, zz = (float(entry[k]) for k in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    com = np.array(numbers(link.find("inertial/origin").get("xyz")))
    return float(link.find("inertial/mass").get("value")), com, tensor


def sampled_inertia(shape: str, size: tuple[float, ...]) -> FloatArray:
    """Inertia of unit mass by summing over a grid of points inside the shape."""
    extent = {"box": size, "sphere": size * 3, "cylinder": (size[0], size[0], size[-1] / 2)}
    extent["cylinder_x"] = (size[-1] / 2, size[0], size[0])
    half = np.array(extent[shape]) * (0.5 if shape == "box" else 1.0)
    axis = (np.arange(120) + 0.5) / 60.0 - 1.0
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    round_axes = {"box": [], "sphere": [0, 1, 2], "cylinder": [0, 1], "cylinder_x": [1, 2]}[shape]
    points = grid[(grid[:, round_axes] ** 2).sum(axis=1) <= 1.0] * half
    return (points**2).sum() / len(points) * np.eye(3) - points.T @ points / len(points)


@pytest.mark.parametrize(
    ("shape", "size"),
    [("box", (0.2, 0.3, 0.1)), ("sphere", (0.1,)), ("cylinder", (0.1, 0.3)), ("cylinder_x", (0.1, 0.3))],
)
def test_part_inertia_is_the_integral_over_the_shape(shape: str, size: tuple[float, ...]) -> None:
    expected = sampled_inertia(shape, size)
    np.testing.assert_allclose(part_inertia(part(shape, size)), expected, atol=3e-3 * expected.max())


def test_two_half_boxes_make_the_whole_box_wherever_it_lies() -> None:
    halves = [part("box", (0.1, 0.2, 0.3), 0.5, (x, 0.4, -0.2)) for x in (0.75, 0.85)]
    body = compose(halves)
    np.testing.assert_allclose(body.com, [0.8, 0.4, -0.2])
    np.testing.assert_allclose(body.inertia, part_inertia(part("box", (0.2, 0.2, 0.3))), atol=1e-16)
    assert body.mass == 1.0


def test_compose_equals_point_masses_for_tiny_far_parts() -> None:
    spheres = [part("sphere", (1e-4,), 2.0, (0, 1, 0)), part("sphere", (1e-4,), 1.0, (0, 0, 3))]
    body = compose(spheres)
    np.testing.assert_allclose(body.com, [0, 2 / 3, 1])
    reduced = 2.0 / 3.0
    expected = reduced * (10.0 * np.eye(3) - np.outer([0, 1, -3], [0, 1, -3]))
    np.testing.assert_allclose(body.inertia, expected, atol=2e-8)


def test_committed_urdf_is_up_to_date() -> None:
    committed = (models_folder() / "bluefoot.urdf").read_text(encoding="utf-8")
    assert committed == make_urdf(load_parameters()), "write it again: bluefoot model urdf"


def test_same_parameters_give_the_same_bytes(parameters: RobotParameters, tmp_path: Path) -> None:
    write_urdf(parameters, tmp_path / "robot.urdf")
    assert (tmp_path / "robot.urdf").read_bytes() == make_urdf(parameters).encode()


def test_links_have_the_mass_and_inertia_of_their_parts(
    parameters: RobotParameters, root: ET.Element
) -> None:
    total = 0.0
    for link in root.findall("link"):
        body_name = link.get("name").split("_")[-1]
        if body_name == "foot":
            assert len(link) == 0
            continue
        mass, com, tensor = inertia_of(link)
        body = compose([p for p in parameters.parts if p.body == body_name])
        np.testing.assert_allclose(mass, body.mass, rtol=1e-13)
        np.testing.assert_allclose(com, body.com, rtol=1e-13, atol=1e-17)
        np.testing.assert_allclose(tensor, body.inertia, rtol=1e-12, atol=1e-13 * np.trace(body.inertia))
        moments = np.linalg.eigvalsh(tensor)
        assert moments[0] > 0.0
        assert moments[0] + moments[1] > moments[2]
        assert numbers(link.find("inertial/origin").get("rpy")) == [0.0, 0.0, 0.0]
        total += mass
    assert total == pytest.approx(parameters.total_mass, rel=1e-12)


def test_every_shape_has_a_unique_name_and_every_visual_a_defined_colour(root: ET.Element) -> None:
    shapes = [*root.iter("visual"), *root.iter("collision")]
    names = [shape.get("name") for shape in shapes]
    assert len(set(names)) == len(names)
    defined = [material.get("name") for material in root.findall("material")]
    assert defined == list(MATERIALS)
    assert {v.find("material").get("name") for v in root.iter("visual")} <= set(defined)


def test_joints_have_the_limits_of_the_mechanism_and_the_servo(
    parameters: RobotParameters, root: ET.Element
) -> None:
    joints = root.findall("joint[@type='revolute']")
    assert [joint.get("name") for joint in joints] == list(JOINTS)
    lower, upper = parameters.legs.physical_limits_deg.radians()
    for index, joint in enumerate(joints):
        limit = joint.find("limit").attrib
        expected = [
            lower[index % 4], upper[index % 4],
            parameters.servo.stall_torque, parameters.servo.no_load_speed,
        ]  # fmt: skip
        actual = [float(limit[key]) for key in ("lower", "upper", "effort", "velocity")]
        np.testing.assert_allclose(actual, expected, rtol=1e-13)


def test_mujoco_keeps_the_floating_trunk_the_feet_and_the_names(
    parameters: RobotParameters, compiled: mujoco.MjModel, capfd: pytest.CaptureFixture[str]
) -> None:
    assert (compiled.nq, compiled.nv, compiled.nbody) == (23, 22, 22)
    assert compiled.body("trunk").parentid == 0
    assert compiled.body_subtreemass[0] == pytest.approx(parameters.total_mass, rel=1e-12)
    for leg in LEGS:
        ball = compiled.geom(f"{leg}_foot_ball")
        assert compiled.body(f"{leg}_foot").mass == 0.0
        assert compiled.body(int(ball.bodyid[0])).name == f"{leg}_link4"
        np.testing.assert_allclose(ball.pos, compiled.body(f"{leg}_foot").pos)
        assert ball.size[0] == parameters.legs.foot_radius
    mujoco.MjSpec.from_string(make_urdf(parameters)).compile()
    assert capfd.readouterr() == ("", "")


def test_only_collision_shapes_touch(root: ET.Element, compiled: mujoco.MjModel) -> None:
    colliding = {compiled.geom(i).name for i in range(compiled.ngeom) if compiled.geom_contype[i]}
    assert colliding == {shape.get("name") for shape in root.iter("collision")}
    assert compiled.ngeom == len(colliding) + len(list(root.iter("visual")))


def test_collision_hulls_enclose_the_centres_of_their_parts(
    parameters: RobotParameters, root: ET.Element
) -> None:
    """A part outside every hull of its link could sink into the floor unnoticed."""
    for name in ("trunk", "FL_link1", "FL_link2", "FL_link3", "FL_link4"):
        hulls = root.findall(f"link[@name='{name}']/collision")
        for p in parameters.parts:
            if p.body == name.split("_")[-1]:
                assert any(contains(hull, np.array(p.position)) for hull in hulls), p.name


def contains(shape: ET.Element, point: FloatArray) -> bool:
    origin = shape.find("origin")
    turn = rotation_from_rpy(np.array(numbers(origin.get("rpy"))))
    local = (point - numbers(origin.get("xyz"))) @ turn
    solid = shape.find("geometry")[0]
    if solid.tag == "box":
        return bool(np.all(np.abs(local) <= 0.5 * np.array(numbers(solid.get("size"))) + 1e-12))
    radius = float(solid.get("radius"))
    if solid.tag == "sphere":
        return bool(np.linalg.norm(local) <= radius)
    return bool(np.hypot(*local[:2]) <= radius and abs(local[2]) <= 0.5 * float(solid.get("length")))


def test_a_changed_parameter_changes_the_urdf(parameters: RobotParameters) -> None:
    legs = dataclasses.replace(parameters.legs, link_lengths=(0.07, 0.06, 0.065, 0.065))
    changed = dataclasses.replace(parameters, legs=legs, name="other")
    root = ET.fromstring(make_urdf(changed))
    assert root.get("name") == "other"
    offsets = [
        numbers(root.find(f"joint[@name='FR_{j}']/origin").get("xyz"))[0] for j in ("hip_pitch", "knee")
    ]
    assert offsets == [0.07, 0.06]


def test_a_robot_without_known_part_names_still_has_shapes(parameters: RobotParameters) -> None:
    plain = tuple(
        Part(name=f"lump_{body}", body=body, mass=0.1, shape="sphere", size=(0.02,), position=(0.01, 0, 0))
        for body in ("trunk", "link1", "link2", "link3", "link4")
    )
    text = make_urdf(dataclasses.replace(parameters, parts=plain))
    assert len(list(ET.fromstring(text).iter("visual"))) == 17
    assert mujoco.MjModel.from_xml_string(text).ngeom == 17 + 1 + 3 * 4 + 2 * 4
