"""Configuration of the whole controller, one section per stage."""

from __future__ import annotations

from dataclasses import dataclass, field

from bluefoot_mpc.control.body_planner import BodyPlannerConfig
from bluefoot_mpc.control.foot_placer import PlacerConfig
from bluefoot_mpc.control.gait_sway import SwayConfig
from bluefoot_mpc.control.ground import GroundAdaptationConfig
from bluefoot_mpc.control.modes import ModeConfig
from bluefoot_mpc.control.posture import PostureConfig
from bluefoot_mpc.control.push_recovery import PushRecoveryConfig
from bluefoot_mpc.control.servo_map import ServoMapConfig
from bluefoot_mpc.control.tracking import TrackingConfig
from bluefoot_mpc.estimation.config import EstimatorConfig
from bluefoot_mpc.gait.config import GaitConfig
from bluefoot_mpc.leveling.config import LevelingConfig
from bluefoot_mpc.model.legs.ankle import AnkleConfig
from bluefoot_mpc.navigation.config import NavigationConfig
from bluefoot_mpc.navigation.crossing.config import CrossingConfig
from bluefoot_mpc.zmp.placement import PlacementConfig
from bluefoot_mpc.zmp.preview import PreviewConfig


@dataclass(frozen=True, kw_only=True, slots=True)
class ControlConfig:
    """Everything that shapes the controller's behaviour."""

    estimator: EstimatorConfig = field(default_factory=EstimatorConfig)
    gait: GaitConfig = field(default_factory=GaitConfig)
    posture: PostureConfig = field(default_factory=PostureConfig)
    ankle: AnkleConfig = field(default_factory=lambda: AnkleConfig(policy="margin"))
    sway: SwayConfig = field(default_factory=SwayConfig)
    zmp: PlacementConfig = field(default_factory=PlacementConfig)
    preview: PreviewConfig = field(default_factory=PreviewConfig)
    navigation: NavigationConfig = field(default_factory=NavigationConfig)
    crossing: CrossingConfig = field(default_factory=CrossingConfig)
    tracking: TrackingConfig = field(default_factory=TrackingConfig)
    ground: GroundAdaptationConfig = field(default_factory=GroundAdaptationConfig)
    placer: PlacerConfig = field(default_factory=PlacerConfig)
    push_recovery: PushRecoveryConfig = field(default_factory=PushRecoveryConfig)
    whole_body: BodyPlannerConfig = field(default_factory=BodyPlannerConfig)
    servo: ServoMapConfig = field(default_factory=ServoMapConfig)
    leveling: LevelingConfig = field(default_factory=LevelingConfig)
    modes: ModeConfig = field(default_factory=ModeConfig)
