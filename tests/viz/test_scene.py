from __future__ import annotations

import json
import xml.etree.ElementTree as ET

import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.types import JOINTS, LEGS
from bluefoot_mpc.viz.scene import RobotScene, build_scene, node_matrices, pose_commands, scene_commands
from bluefoot_mpc.viz.style import LEG_COLOURS


@pytest.fixture(scope="module")
def scene(robot: RobotModel) -> RobotScene:
    return build_scene(robot)


def test_every_visual_of_the_urdf_is_there(scene: RobotScene, robot: RobotModel) -> None:
    wanted = len(ET.fromstring(robot.urdf).findall(".//visual"))
    assert len(scene.visuals) == wanted
    drawn = [
        len(c["object"]["object"]["children"]) for c in scene_commands(scene) if c["type"] == "set_object"
    ]
    assert sum(drawn) == wanted
    assert len({visual.path for visual in scene.visuals}) == wanted


def test_nodes_follow_pinocchio(scene: RobotScene, robot: RobotModel) -> None:
    rng = np.random.default_rng(3)
    assert [node.name for node in scene.nodes] == ["trunk", *JOINTS]
    for _ in range(5):
        q = pin.randomConfiguration(robot.pin_model, np.full(23, -1.0), np.full(23, 1.0))
        q[7:] = rng.uniform(-1.5, 1.5, 16)
        pin.forwardKinematics(robot.pin_model, robot.pin_data, q)
        places = {}
        for node, matrix in zip(scene.nodes, node_matrices(scene, q), strict=True):
            parent = node.path.rsplit("/", 1)[0]
            places[node.path] = places.get(parent, np.eye(4)) @ matrix
        for index, node in enumerate(scene.nodes):
            np.testing.assert_allclose(
                places[node.path], robot.pin_data.oMi[index + 1].homogeneous, rtol=0.0, atol=1e-12
            )


def test_commands_are_plain_json(scene: RobotScene, robot: RobotModel) -> None:
    commands = [*scene_commands(scene), *pose_commands(scene, robot.default_stance())]
    assert json.loads(json.dumps(commands)) == commands
    assert {command["type"] for command in commands} == {"set_object", "set_transform"}


def test_feet_wear_their_legs_colour(scene: RobotScene) -> None:
    balls = [visual for visual in scene.visuals if visual.shape == "sphere" and "_ankle/" in visual.path]
    assert [f"#{ball.colour:06x}" for ball in balls] == [LEG_COLOURS[leg] for leg in LEGS]
