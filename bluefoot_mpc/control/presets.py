"""The controllers that can be chosen by name: each is one configuration of the same pipeline."""

from __future__ import annotations

from bluefoot_mpc.control.body_planner import BodyPlannerConfig
from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.gait_sway import SwayConfig
from bluefoot_mpc.control.ground import GroundAdaptationConfig
from bluefoot_mpc.control.level import CentringConfig
from bluefoot_mpc.control.names import CONTROLLERS
from bluefoot_mpc.control.posture import PostureConfig
from bluefoot_mpc.control.servo_map import ServoMapConfig
from bluefoot_mpc.control.tracking import TrackingConfig
from bluefoot_mpc.exceptions import UnknownNameError
from bluefoot_mpc.gait.config import GaitConfig
from bluefoot_mpc.gait.tuned import LEG_LENGTH, ROUGH, TROT, WALK
from bluefoot_mpc.leveling.config import AttitudeGains, LevelingConfig
from bluefoot_mpc.model.parameters import RobotParameters
from bluefoot_mpc.zmp.preview.config import PreviewConfig, PreviewWeights
from bluefoot_mpc.zmp.support import SupportConfig


def preset(name: str, robot: RobotParameters | None = None) -> ControlConfig:
    """The configuration of a controller.

    Args:
        name: one of `CONTROLLERS`.
        robot: whose legs the lengths are scaled to; None for BlueFoot's.

    Raises:
        UnknownNameError: there is no such controller.
    """
    if name == "cpg":
        return ControlConfig()
    if name == "mpc":
        # Rounded, so that BlueFoot itself is exactly of size one.
        size = 1.0 if robot is None else round(sum(robot.legs.link_lengths) / LEG_LENGTH, 6)
        return ControlConfig(
            sway=SwayConfig(trot="static", walk="preview"),
            preview=_preview(),
            gait=GaitConfig(
                trot_table=TROT.scaled(size), walk_table=WALK.scaled(size), rough_table=ROUGH.scaled(size)
            ),
            posture=PostureConfig(centring=CentringConfig(enabled=True)),
            tracking=TrackingConfig(velocity_gain=0.8, velocity_bound=0.08, wait_for_ramp=True),
            ground=GroundAdaptationConfig(enabled=True),
            whole_body=BodyPlannerConfig(enabled=True),
            servo=ServoMapConfig(mixing=0.6, back_emf=1.0),
            leveling=LevelingConfig(form="residual", gains=AttitudeGains(tilt=200.0, tilt_rate=10.0)),
        )
    raise UnknownNameError("controller", name, CONTROLLERS)


def _preview() -> PreviewConfig:
    return PreviewConfig(
        centre_pull=0.2, support=SupportConfig(margin=0.025),
        weights=PreviewWeights(jerk=5e-6),
    )  # fmt: skip
