"""Data that flows between the stages: small frozen records, arrays in SI units.

House order of legs is ``FL, FR, RL, RR``; joint vectors are leg-major, sixteen
long: ``hip_yaw, hip_pitch, knee, ankle`` of FL, then FR, RL, RR. Frames follow
REP-103 (x forward, y left, z up). Quaternions are ``x, y, z, w``.
"""

from __future__ import annotations

from bluefoot_mpc.types.command import Guide, GuideTask, JointCommand, Mode, MotionCommand, TrunkPose
from bluefoot_mpc.types.common import JOINTS, LEG_JOINTS, LEGS, N_JOINTS, N_LEGS, BoolArray, FloatArray
from bluefoot_mpc.types.safety import SafetyLevel, SafetyRequest
from bluefoot_mpc.types.sensors import CameraImage, ImuBatch, LidarScan, SensorFrame
from bluefoot_mpc.types.state import BodyState, ContactSchedule, GaitPhase, PostureReference
from bluefoot_mpc.types.telemetry import (
    Fallback,
    Guided,
    LevelReport,
    NavigationReport,
    PlanReport,
    Telemetry,
)
from bluefoot_mpc.types.terrain import CrossingPhase, CrossingReport, HeightMap
from bluefoot_mpc.types.truth import TruthSample

__all__ = [
    "JOINTS",
    "LEGS",
    "LEG_JOINTS",
    "N_JOINTS",
    "N_LEGS",
    "BodyState",
    "BoolArray",
    "CameraImage",
    "ContactSchedule",
    "CrossingPhase",
    "CrossingReport",
    "Fallback",
    "FloatArray",
    "GaitPhase",
    "Guide",
    "GuideTask",
    "Guided",
    "HeightMap",
    "ImuBatch",
    "JointCommand",
    "LevelReport",
    "LidarScan",
    "Mode",
    "MotionCommand",
    "NavigationReport",
    "PlanReport",
    "PostureReference",
    "SafetyLevel",
    "SafetyRequest",
    "SensorFrame",
    "Telemetry",
    "TrunkPose",
    "TruthSample",
]
