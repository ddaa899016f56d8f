"""Whole-body control: tasks and constraints in, joint accelerations, ground forces and torques out."""

from bluefoot_mpc.wbc.config import WholeBodyConfig, WholeBodyGains, WholeBodyWeights
from bluefoot_mpc.wbc.controller import WholeBodyController
from bluefoot_mpc.wbc.inputs import WholeBodyInputs, WholeBodyPlan
from bluefoot_mpc.wbc.model import Actuators, WholeBodyModel

__all__ = [
    "Actuators",
    "WholeBodyConfig",
    "WholeBodyController",
    "WholeBodyGains",
    "WholeBodyInputs",
    "WholeBodyModel",
    "WholeBodyPlan",
    "WholeBodyWeights",
]
