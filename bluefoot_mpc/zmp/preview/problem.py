"""One tick's preview problem in fixed arrays: start, references, rows, and where a path meets them."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.types import BoolArray, Fallback, FloatArray
from bluefoot_mpc.zmp.binding import Bound
from bluefoot_mpc.zmp.preview.config import PreviewConfig
from bluefoot_mpc.zmp.preview.inputs import PreviewInputs
from bluefoot_mpc.zmp.preview.model import PreviewMaps, levers
from bluefoot_mpc.zmp.preview.plan import ComPlan
from bluefoot_mpc.zmp.preview.symbols import residual_function, rows_function
from bluefoot_mpc.zmp.support import standing_samples
from bluefoot_mpc.zmp.support_symbols import margin_function


class PreviewProblem:
    """Workspace of one tick's problem; holds no memory of earlier ones.

    Constrained points are the ZMP (n) and the centre of mass (n) at the samples
    and the capture point at the end, with four rows ``normal · point <= offset``
    each: 2n + 1 points, 8n + 4 rows.

    Attributes:
        given: (3 + 3n, 2) start, wanted ZMP, position and velocity.
        levers: (n,) s², distance of the ZMP from the centre of mass per acceleration.
        normals: (8n + 4, 2) unit vectors of the rows.
        path: (4n, 2) positions, velocities, accelerations and jerks of a plan.
        residuals: (8n + 4,) m, how far that path lies inside the rows.

    Args:
        config: sizes, bounds and defaults.
        maps: the problem of one axis.
    """

    def __init__(self, config: PreviewConfig, maps: PreviewMaps) -> None:
        n = config.samples
        self._config, self._maps, self._samples = config, maps, n
        self._time = np.float64(config.interval) * np.arange(1, n + 1)
        self.given, self.path = np.zeros((3 + 3 * n, 2)), np.zeros((4 * n, 2))
        self._wanted, self._nominal, self._velocity = self.given[3:].reshape(3, n, 2)
        self._level, self._ahead = np.full(n, maps.lever), np.array([1.0, 0.0])
        self._usual_reach, self._starts = np.array(config.reach), np.array([0, 4 * n, 8 * n])
        self.levers = self._level.copy()
        self.normals, self._offsets = np.zeros((8 * n + 4, 2)), np.zeros((2 * n, 4))
        self.residuals, self._zmp = np.zeros(8 * n + 4), np.zeros((n, 2))
        self._plain, self._edges = np.zeros((n, 4)), np.zeros((n, 4, 2, 2))
        self._margin = np.zeros(n)
        self._valid: BoolArray = np.zeros(n, dtype=np.bool_)
        self._known = False  # some sample has a foot
        self._bind(n)

    def _bind(self, n: int) -> None:
        config, support = self._config, self._config.support
        self._feet, self._stance = np.zeros((n, 4, 2)), np.zeros((n, 4))
        self._gravity = np.zeros(2)
        self._heading, self._reach = np.zeros((n, 2)), np.zeros((n, 2))
        choices = np.array([support.margin, support.half_width, config.depth, config.centre_pull])
        self._choices = choices
        at_zmp, at_com = self.normals[: 4 * n], self.normals[4 * n : 8 * n]
        of_zmp, of_com = self._offsets[:n], self._offsets[n:]
        self._rows = Bound(
            rows_function(n),
            (self._feet, self._stance, self._nominal, self._heading, self._reach, choices),
            (self._wanted, at_zmp, of_zmp, self._plain, self._edges, at_com, of_com),
        )
        parts = self.residuals[: 4 * n], self.residuals[4 * n : 8 * n], self.residuals[8 * n :]
        self._inside = Bound(
            residual_function(n),
            (self.path[:n], self.path[2 * n : 3 * n], self.levers, at_zmp, of_zmp, at_com, of_com,
             self._gravity, self.path[2 * n - 1]),
            (self._zmp, *parts),
        )  # fmt: skip
        self._measure = Bound(
            margin_function(n), (self._zmp, at_zmp, self._plain, self._edges), (self._margin,)
        )

    def path_map(self, jerks: FloatArray) -> FloatArray:
        """(4n, 3 + 3n) path by what is given, of a law that is (n, 3 + 3n) jerks by what is given."""
        path = np.vstack([self._maps.forced @ jerks, jerks])
        path[: 3 * self._samples, :3] += self._maps.free
        return np.asarray(path)

    def read(self, inputs: PreviewInputs, start: FloatArray) -> bool:
        """Take one tick's inputs; False when no plan can be made of them.

        Numbers that are not finite show in the residuals of any path.
        """
        n = self._samples
        self._valid = standing_samples(inputs.schedule, self._feet, self._stance)
        self.given[:3] = start
        self._nominal[:] = inputs.nominal
        self._reach[:] = self._usual_reach if inputs.reach is None else inputs.reach
        self._heading[:] = self._ahead
        if inputs.heading is not None:
            self._heading[:, 0], self._heading[:, 1] = np.cos(inputs.heading), np.sin(inputs.heading)
        self._choices[0], self._choices[2] = inputs.margin or (
            self._config.support.margin, self._config.depth
        )  # fmt: skip
        self._rows.call()
        self.normals[8 * n :] = self.normals[4 * n - 4 : 4 * n]
        if inputs.zmp is not None:
            self._wanted[:] = inputs.zmp
        if inputs.velocity is not None:
            self._velocity[:] = inputs.velocity
        else:
            np.subtract(self._nominal[1:], self._nominal[:-1], out=self._velocity[1:])
            self._velocity[1:] *= 1.0 / self._config.interval
            self._velocity[0] = self._velocity[1]
        self._known = bool(self._valid.any())
        return self._take_height(inputs) and self._known

    def read_way(self, start: FloatArray, goal: FloatArray) -> None:
        """Take the straight way from a (3, 2) start to a (2,) goal at the configured speed."""
        way = goal - start[0]
        distance = float(np.hypot(*way))
        reached = np.minimum(self._config.stance_speed * self._time, distance)
        self.given[:3] = start
        self._nominal[:] = start[0] + reached[:, None] * (way / max(distance, 1e-9))
        self._wanted[:] = self._nominal
        self._velocity[:] = 0.0
        self.levers[:], self._gravity[:] = self._level, 0.0
        self._known = self._known and bool(
            np.isfinite(self._edges).all() and np.isfinite(self._offsets).all()
        )

    def evaluate(self) -> FloatArray:
        """(8n + 4,) m, residuals of the path; the array is overwritten by the next call."""
        self._inside.call()
        return self.residuals

    def plan(self, status: Fallback, iterations: int) -> ComPlan:
        """The plan of the path, evaluated before, with its margins and violations."""
        n = self._samples
        position, velocity, acceleration, jerk = self.path.copy().reshape(4, n, 2)
        if self._known:
            self._measure.call()
            margin, supported = self._margin.copy(), self._valid
            slack = np.maximum(-np.minimum.reduceat(self.residuals, self._starts), 0.0)
        else:
            margin, supported, slack = np.full(n, np.nan), self._valid, np.full(3, np.nan)
        return ComPlan(
            time=self._time, start=self.given[:3].copy(), position=position, velocity=velocity,
            acceleration=acceleration, jerk=jerk, zmp=self._zmp.copy(), margin=margin,
            supported=supported, slack=slack, status=status, iterations=iterations,
        )  # fmt: skip

    def _take_height(self, inputs: PreviewInputs) -> bool:
        """Take levers and gravity; False where the centre of mass does not press on the ground."""
        height, gravity = inputs.height, inputs.gravity
        if height is None and inputs.rise is None and gravity is None:
            self.levers[:], self._gravity[:] = self._level, 0.0
            return True
        self.levers[:] = levers(
            self._config.height if height is None else height, inputs.rise, inputs.slope, gravity
        )
        if gravity is not None:
            self._gravity[:] = gravity[:2]
            self._wanted -= self.levers[:, None] * self._gravity  # the cost's ZMP leaves gravity out
        return bool(self.levers.min() > 0.0 and self.levers.max() < np.inf)
