"""The law by which the trunk sways, chosen for each gait and blended on the way from one to the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from bluefoot_mpc.control.preview_sway import PreviewSway
from bluefoot_mpc.control.sway import Sway
from bluefoot_mpc.gait.gait import GaitOutput
from bluefoot_mpc.settings import require_nonnegative
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.zmp.preview import ComPlan

Law = Literal["static", "preview"]


@dataclass(frozen=True, kw_only=True, slots=True)
class SwayConfig:
    """Which law moves the trunk for balance: the paper's static placement, or ZMP preview."""

    trot: Law = "static"
    walk: Law = "static"
    rough_margin: float = 0.016  # m, the preview's support margin over rough ground: legs have less to spare
    rough_depth: float = 0.004  # m inside of it, where the ZMP is wanted there

    def __post_init__(self) -> None:
        require_nonnegative(rough_margin=self.rough_margin, rough_depth=self.rough_depth)


class GaitSway:
    """Sways by the law of the present gait.

    A law that has no say is not run, and forgets.

    Attributes:
        offset: (2,) m, the sway's share of the trunk's place in b'.

    Args:
        config: the law of each gait.
        static: the paper's placement law.
        preview: the preview; None where no gait wants it.
    """

    def __init__(self, config: SwayConfig, static: Sway, preview: PreviewSway | None) -> None:
        self._shares = (float(config.trot == "preview"), float(config.walk == "preview"))
        self._static, self._preview = static, preview
        self.reset()

    def reset(self) -> None:
        """Back to the neutral place, without a commanded pose."""
        self.offset = np.zeros(2)
        self._static.reset()
        if self._preview is not None:
            self._preview.reset()

    @property
    def plan(self) -> ComPlan | None:
        """The preview's plan of the last tick; None where it had no say."""
        return None if self._preview is None else self._preview.plan

    def follow(self, pose: FloatArray) -> None:
        """Take note of a change of the commanded pose, (6,) m and rad."""
        self._static.follow(pose)
        if self._preview is not None:
            self._preview.follow(pose)

    def step(self, gait: GaitOutput, joints: FloatArray, trunk: FloatArray, dt: float) -> FloatArray:
        """Advance the offset; gives the (2,) ZMP that the law plans or assumes, m in b', NaN when it is off.

        Args:
            gait: feet in b' and the gait's phase.
            joints: (16,) rad.
            trunk: (3,) m, wanted trunk origin in b'.
            dt: s.
        """
        trot, walk = self._shares
        share = trot + gait.place * (walk - trot)
        neutral = trunk[:2] - self.offset
        if self._preview is None or share == 0.0:
            if self.plan is not None and self._preview is not None:
                self._preview.forget()
            zmp = self._stepped(self._static, gait, joints, neutral, trunk[2], dt)
            self.offset = self._static.offset
            return zmp
        zmp = self._stepped(self._preview, gait, joints, neutral, trunk[2], dt)
        self.offset = self._preview.offset
        if share < 1.0:
            other = self._stepped(self._static, gait, joints, neutral, trunk[2], dt)
            self.offset = share * self.offset + (1.0 - share) * self._static.offset
            zmp = share * zmp + (1.0 - share) * other
        return zmp

    def _stepped(
        self, law: Sway | PreviewSway, gait: GaitOutput, joints: FloatArray, neutral: FloatArray,
        height: float, dt: float,
    ) -> FloatArray:  # fmt: skip
        """The (2,) ZMP of one law, which sees the trunk where it alone would have put it."""
        x, y = (neutral + law.offset).tolist()
        return law.step(gait, joints, np.array([x, y, height]), dt)
