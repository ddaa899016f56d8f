"""The controllers that can be chosen by name: each is one configuration of the same pipeline."""

from __future__ import annotations

from bluefoot_mpc.control.body_planner import BodyPlannerConfig
from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.ground import GroundAdaptationConfig
from bluefoot_mpc.control.servo_map import ServoMapConfig
from bluefoot_mpc.exceptions import UnknownNameError

CONTROLLERS = ("cpg", "mpc")
"""``cpg``: the paper's laws. ``mpc``: preview and whole-body control beside them."""
DEFAULT_CONTROLLER = "cpg"
"""What runs where nobody chooses."""


def preset(name: str) -> ControlConfig:
    """The configuration of a controller.

    Raises:
        UnknownNameError: there is no such controller.
    """
    if name == "cpg":
        return ControlConfig()
    if name == "mpc":
        return ControlConfig(
            ground=GroundAdaptationConfig(enabled=True),
            whole_body=BodyPlannerConfig(enabled=True),
            servo=ServoMapConfig(mixing=0.6, back_emf=1.0),
        )
    raise UnknownNameError("controller", name, CONTROLLERS)
