"""State of the body from inertial samples, joint angles and foot switches."""

from bluefoot_mpc.estimation.config import (
    ContactConfig,
    EstimatorConfig,
    HeadingConfig,
    ImuConfig,
    JointFilterConfig,
    RestConfig,
)
from bluefoot_mpc.estimation.estimator import Estimator

__all__ = [
    "ContactConfig",
    "Estimator",
    "EstimatorConfig",
    "HeadingConfig",
    "ImuConfig",
    "JointFilterConfig",
    "RestConfig",
]
