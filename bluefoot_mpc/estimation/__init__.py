"""State of the body from inertial samples, joint angles and foot switches."""

from bluefoot_mpc.estimation.config import (
    ContactConfig,
    EstimatorConfig,
    GroundConfig,
    HeadingConfig,
    ImuConfig,
    JointFilterConfig,
    LevelConfig,
    RestConfig,
)
from bluefoot_mpc.estimation.estimator import Estimator
from bluefoot_mpc.estimation.ground import GroundEstimate, GroundPlane

__all__ = [
    "ContactConfig",
    "Estimator",
    "EstimatorConfig",
    "GroundConfig",
    "GroundEstimate",
    "GroundPlane",
    "HeadingConfig",
    "ImuConfig",
    "JointFilterConfig",
    "LevelConfig",
    "RestConfig",
]
