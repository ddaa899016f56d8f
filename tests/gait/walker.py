"""Helpers of the gait tests: a nominal stance, a configuration, and a run that records."""

from dataclasses import dataclass, replace

import numpy as np

from bluefoot_mpc.gait.footholds import FootholdConfig
from bluefoot_mpc.gait.gait import Gait, GaitConfig, GaitInputs, GaitOutput
from bluefoot_mpc.gait.timing import GaitTiming

STANCE = np.array([[0.165, 0.165, 0.0], [0.165, -0.165, 0.0], [-0.165, 0.165, 0.0], [-0.165, -0.165, 0.0]])
DT = 0.02
TROT_TIMING = GaitTiming(
    swing_share=0.36,
    coupling_gain=0.15,
    a_v=300.0,
    a_omega=40.0,
    cycle_min=0.4,
    cycle_max=0.7,
    height_v=0.15,
    height_omega=0.02,
    height_min=0.015,
    height_max=0.035,
)
WALK_TIMING = replace(TROT_TIMING, swing_share=0.22, a_v=400.0, a_omega=60.0, cycle_min=0.8, cycle_max=1.5)
FOOTHOLD = FootholdConfig(
    law="virtual_force",
    vertical="sine",
    stance_lead=0.5,
    swing_rate=6.5,
    damping_ratio=1.05,
    ground_damping=False,
    ground_matching=1.0,
    apex=0.5,
    early_contact=False,
)
# Written out, so that tuning the defaults does not move what these tests measure.
REFERENCE = GaitConfig(
    trot=TROT_TIMING,
    walk=WALK_TIMING,
    foothold=FOOTHOLD,
    blend_time=2.0,
    max_acceleration=0.1,
    max_yaw_acceleration=1.0,
    settle_cycles=1.0,
    substep=0.01,
)


def command(forward=0.0, yaw_rate=0.0, gait="trot", left=0.0, **more) -> GaitInputs:
    return GaitInputs(velocity=np.array([forward, left]), yaw_rate=yaw_rate, gait=gait, **more)


def make(timing: GaitTiming | None = None, foothold: FootholdConfig | None = None, **more) -> Gait:
    config = replace(REFERENCE, trot=timing or TROT_TIMING, foothold=foothold or FOOTHOLD)
    return Gait(replace(config, **more), STANCE)


@dataclass
class Run:
    outputs: list[GaitOutput]

    def __getattr__(self, name: str) -> np.ndarray:
        if hasattr(self.outputs[0], name):
            return np.array([getattr(o, name) for o in self.outputs])
        return np.array([getattr(o.phase, name) for o in self.outputs])

    @property
    def in_world(self) -> np.ndarray:
        x, y, yaw = self.virtual_pose.T
        turn = np.exp(1j * yaw)[:, None]
        feet = self.foot_position[:, :, 0] + 1j * self.foot_position[:, :, 1]
        return (x + 1j * y)[:, None] + turn * feet


def drive(gait: Gait, inputs: GaitInputs, seconds: float, dt: float = DT) -> Run:
    return Run([gait.step(inputs, dt) for _ in range(round(seconds / dt))])
