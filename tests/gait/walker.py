"""Helpers of the gait tests: a nominal stance, a configuration, and a run that records."""

from dataclasses import dataclass, replace

import numpy as np

from bluefoot_mpc.gait.footholds import FootholdConfig
from bluefoot_mpc.gait.gait import Gait, GaitConfig, GaitInputs, GaitOutput
from bluefoot_mpc.gait.timing import GaitTiming

STANCE = np.array([[0.165, 0.165, 0.0], [0.165, -0.165, 0.0], [-0.165, 0.165, 0.0], [-0.165, -0.165, 0.0]])
DT = 0.02


def command(forward=0.0, yaw_rate=0.0, gait="trot", left=0.0, **more) -> GaitInputs:
    return GaitInputs(velocity=np.array([forward, left]), yaw_rate=yaw_rate, gait=gait, **more)


def make(timing: GaitTiming | None = None, foothold: FootholdConfig | None = None, **more) -> Gait:
    config = GaitConfig(**more)
    if timing is not None:
        config = replace(config, trot=timing)
    if foothold is not None:
        config = replace(config, foothold=foothold)
    return Gait(config, STANCE)


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
