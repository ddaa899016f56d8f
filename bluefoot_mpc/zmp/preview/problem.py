"""One tick's preview problem: start, references, rows and levers in fixed arrays, and the plan of a path."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.types import Fallback, FloatArray
from bluefoot_mpc.zmp.preview.config import PreviewConfig
from bluefoot_mpc.zmp.preview.inputs import PreviewInputs
from bluefoot_mpc.zmp.preview.model import PreviewMaps, levers
from bluefoot_mpc.zmp.preview.plan import ComPlan
from bluefoot_mpc.zmp.preview.program import Rows
from bluefoot_mpc.zmp.support import Support, SupportPreview

_BOX = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])


class PreviewProblem:
    """Workspace of one tick's problem; holds no memory of earlier ones.

    A path is (4n, 2): positions, velocities, accelerations and jerks of both axes.

    Attributes:
        given: (3 + 3n, 2) start, wanted ZMP, position and velocity.
        rows: the constraints.
        levers: (n,) s², distance of the ZMP from the centre of mass per acceleration.

    Args:
        config: sizes, bounds and defaults.
        maps: the problem of one axis.
    """

    def __init__(self, config: PreviewConfig, maps: PreviewMaps) -> None:
        n = config.samples
        self._config, self._maps = config, maps
        self._time = np.float64(config.interval) * np.arange(1, n + 1)
        self._support_preview = SupportPreview(config.support, n)
        self._support: Support | None = None
        self.given = np.zeros((3 + 3 * n, 2))
        self._zmp, self._position, self._velocity = self.given[3:].reshape(3, n, 2)
        self.rows = Rows(normals=np.zeros((2 * n + 1, 4, 2)), offsets=np.zeros((2 * n + 1, 4)))
        self.levers = np.zeros(n)
        self._height, self._rise = np.zeros(n), np.zeros(n)
        self._values = np.zeros((2 * n + 1, 2))
        self._reach = np.zeros((n, 2))

    def path_map(self, jerks: FloatArray) -> FloatArray:
        """(4n, 3 + 3n) path by what is given, of a law that is (n, 3 + 3n) jerks by what is given."""
        path = np.vstack([self._maps.forced @ jerks, jerks])
        path[: len(self._maps.free), :3] += self._maps.free
        return np.asarray(path)

    def read(self, inputs: PreviewInputs, start: FloatArray) -> bool:
        """Take one tick's inputs; False when no plan can be made of them."""
        support = self._support = self._support_preview.build(inputs.schedule)
        self._take_height(inputs)
        self._take_references(inputs, start, support)
        self._take_rows(inputs, support)
        # One sum is finite only where every part is.
        total = self.given.sum() + self.levers.sum() + self.rows.offsets.sum() + self.rows.normals.sum()
        return bool(np.isfinite(total) and self.levers.min() > 0.0 and support.valid.any())

    def read_way(self, start: FloatArray, goal: FloatArray) -> None:
        """Take the straight way from a (3, 2) start to a (2,) goal at the configured speed."""
        way = goal - start[0]
        distance = float(np.hypot(*way))
        reached = np.minimum(self._config.stance_speed * self._time, distance)
        self.given[:3] = start
        self._position[:] = start[0] + reached[:, None] * (way / max(distance, 1e-9))
        self._zmp[:] = self._position
        self._velocity[:] = 0.0
        self.levers[:] = self._maps.lever
        if self._support is not None and not np.isfinite(self._support.edges).all():
            self._support = None

    def values(self, path: FloatArray) -> FloatArray:
        """(2n + 1, 2) m, constrained points of a path: ZMP, centre of mass, capture point at the end."""
        n = len(self.levers)
        self._values[:n] = path[:n] - self.levers[:, None] * path[2 * n : 3 * n]
        self._values[n : 2 * n] = path[:n]
        self._values[2 * n] = path[n - 1] + np.sqrt(self.levers[-1]) * path[2 * n - 1]
        return self._values

    def plan(self, path: FloatArray, start: FloatArray, status: Fallback, iterations: int) -> ComPlan:
        """The plan of a path, with its margins and violations."""
        n, values = len(self.levers), self.values(path)
        position, velocity, acceleration, jerk = path.copy().reshape(4, n, 2)
        zmp = values[:n].copy()
        support = self._support
        if support is None or not support.valid.any():
            margin, slack, supported = np.full(n, np.nan), np.full(3, np.nan), np.zeros(n, dtype=np.bool_)
        else:
            margin, supported = self._support_preview.margins(zmp).copy(), support.valid
            slack = self._slack(values)
        return ComPlan(
            time=self._time, start=np.array(start), position=position, velocity=velocity,
            acceleration=acceleration, jerk=jerk, zmp=zmp, margin=margin, supported=supported,
            slack=slack, status=status, iterations=iterations,
        )  # fmt: skip

    def _slack(self, values: FloatArray) -> FloatArray:
        n, inside = len(self.levers), self.rows.residuals(values)
        parts = inside[: 4 * n].min(), inside[4 * n : 8 * n].min(), inside[8 * n :].min()
        return np.array([max(0.0, -float(part)) for part in parts])

    def _take_height(self, inputs: PreviewInputs) -> None:
        self._height[:] = self._config.height if inputs.height is None else inputs.height
        self._rise[:] = 0.0 if inputs.rise is None else inputs.rise
        self.levers[:] = levers(self._height, self._rise, inputs.slope, inputs.gravity)

    def _take_references(self, inputs: PreviewInputs, start: FloatArray, support: Support) -> None:
        self.given[:3] = start
        nominal = self._position
        nominal[:] = inputs.nominal
        if inputs.velocity is not None:
            self._velocity[:] = inputs.velocity
        else:
            np.subtract(nominal[1:], nominal[:-1], out=self._velocity[1:])
            self._velocity[1:] /= self._config.interval
            self._velocity[0] = self._velocity[1]
        if inputs.zmp is not None:
            self._zmp[:] = inputs.zmp
        else:
            self._zmp[:] = nominal
            if self._config.centre_pull > 0.0:
                self._zmp += self._config.centre_pull * (support.centre - nominal)

    def _take_rows(self, inputs: PreviewInputs, support: Support) -> None:
        n, normals, offsets = len(self.levers), self.rows.normals, self.rows.offsets
        normals[:n], offsets[:n] = support.normals, support.offsets
        normals[2 * n], offsets[2 * n] = support.normals[-1], support.offsets[-1]
        box, around = normals[n : 2 * n], offsets[n : 2 * n]
        if inputs.heading is None:
            box[:] = _BOX
        else:
            c, s = np.cos(inputs.heading), np.sin(inputs.heading)
            box[:, 0], box[:, 2] = np.stack([c, s], axis=1), np.stack([-s, c], axis=1)
            np.negative(box[:, 0::2], out=box[:, 1::2])
        self._reach[:] = self._config.reach if inputs.reach is None else inputs.reach
        middle = self._position
        along = box[:, 0::2, 0] * middle[:, :1] + box[:, 0::2, 1] * middle[:, 1:]
        np.add(along, self._reach, out=around[:, 0::2])
        np.subtract(self._reach, along, out=around[:, 1::2])
