"""How far the odometry has drifted between two height maps: the older one fitted to the newer.

Both see the same ground; where they overlap, the shift (x, y, z, yaw) is sought that makes their heights
agree: a coarse grid, then Gauss-Newton on bilinear heights with Tukey's weights. A tilt between the maps, an
error of the estimated attitude, is fitted along but not given back.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import wrap_angle
from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.terrain.filters import slopes
from bluefoot_mpc.terrain.frame import bilinear, centres, to_map
from bluefoot_mpc.types import FloatArray, HeightMap

_PARAMETERS = 6
"""x, y, yaw, z and the two slopes of a tilt."""
_EVERY = 3
"""One cell in so many is looked at on the coarse grid."""
_MOST_TRIES = 20_000
"""On the coarse grid: more take longer than the robot should stand and think."""
_CORRELATED = 4.0
"""Cells that share their noise: edges cross several, and both maps cut them into the same squares."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Bounds:
    """How far a map may have to be moved, and when a fit is believed."""

    shift: float = 0.030  # m, in x and in y
    height: float = 0.020  # m
    turn_deg: float = 3.0  # degrees
    tilt_deg: float = 1.5  # degrees, of the attitude's error between the maps
    overlap: int = 300  # cells that both maps know, at least
    misfit: float = 0.008  # m, of heights; beyond some times this a cell is left out
    sure: float = 0.004  # m, standard deviation of a shift that is believed
    sure_deg: float = 0.5  # degrees, of a turn that is believed
    step: float = 0.015  # m, of the coarse grid
    step_deg: float = 1.5  # degrees
    iterations: int = 8  # of the refinement

    def __post_init__(self) -> None:
        require_positive(
            shift=self.shift, height=self.height, turn_deg=self.turn_deg, tilt_deg=self.tilt_deg,
            overlap=self.overlap, misfit=self.misfit, sure=self.sure, sure_deg=self.sure_deg, step=self.step,
            step_deg=self.step_deg,
        )  # fmt: skip
        require_range(0, 100, iterations=self.iterations)
        require_range(0.0, 30.0, turn_deg=self.turn_deg)
        tries = (2.0 * self.shift / self.step + 1.0) ** 2 * (2.0 * self.turn_deg / self.step_deg + 1.0)
        if tries > _MOST_TRIES:
            raise ConfigurationError(
                f"steps of {self.step:g} m and {self.step_deg:g} degrees within {self.shift:g} m and "
                f"{self.turn_deg:g} degrees are {tries:.3g} tries: make them {_MOST_TRIES} or fewer"
            )


@dataclass(frozen=True, kw_only=True, slots=True)
class Shift:
    """How the older map is to be moved to lie on the newer: turned about a centre, then moved.

    Attributes:
        x: m, forward in the odometry frame.
        y: m, to the left.
        z: m, up.
        yaw: rad.
        centre: (x, y) m in the odometry frame, what the turn is about.
        overlap: cells that both maps know.
        misfit: m, root mean square of the height differences that are left, of the cells that count.
        reason: why x, y and yaw are 0 although they were sought; empty where they were found.
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    yaw: float = 0.0
    centre: tuple[float, float] = (0.0, 0.0)
    overlap: int = 0
    misfit: float = math.nan
    reason: str = ""

    def apply(self, places: FloatArray) -> FloatArray:
        """(k, 3) m, where points of the older sweep are by the newer, odometry frame.

        Args:
            places: (k, 3) m, odometry frame.
        """
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        flat = (places[:, :2] - self.centre) @ np.array(((c, s), (-s, c))) + self.centre
        return np.column_stack((flat + np.array((self.x, self.y)), places[:, 2] + self.z))


def align(old: HeightMap, new: HeightMap, bounds: Bounds | None = None) -> Shift:
    """The shift that lays the older map on the newer, or no sideways shift and why.

    Even ground tells the height between the maps but nothing sideways; then only `Shift.z` is given.

    Args:
        old: the older map.
        new: the newest sweep's.
        bounds: how far it may be, and what is believed.
    """
    bounds = bounds or Bounds()
    pair = _Pair(old, new)
    if pair.overlap < bounds.overlap:
        return Shift(
            overlap=pair.overlap,
            reason=f"the maps share {pair.overlap} cells, {bounds.overlap} are needed",
        )
    fit = _refined(pair, _coarse(pair, bounds), bounds)
    centre = (float(pair.centre[0]), float(pair.centre[1]))
    x, y, yaw, z = fit.state[:4].tolist()
    reason = _doubt(fit, bounds)
    if reason:
        level = pair.level()
        return Shift(
            z=level if abs(level) <= bounds.height else 0.0,
            centre=centre,
            overlap=pair.overlap,
            misfit=fit.misfit,
            reason=reason,
        )
    return Shift(x=x, y=y, z=z, yaw=wrap_angle(yaw), centre=centre, overlap=pair.overlap, misfit=fit.misfit)


def moved(old: HeightMap, shift: Shift) -> HeightMap:
    """A map after a shift, on its own cells: each takes the height of the older cell that now lies on it.

    Args:
        old: the map.
        shift: how it is to be moved.
    """
    back = _back(centres(old), np.array((shift.x, shift.y, shift.yaw)), np.array(shift.centre))
    index = np.floor(to_map(old, back) / old.cell)
    n, m = old.height.shape
    inside = (index >= 0.0).all(axis=-1) & (index[..., 0] < m) & (index[..., 1] < n)
    j, i = np.moveaxis(np.where(inside[..., None], index, 0.0).astype(np.intp), -1, 0)
    known = inside & np.isfinite(old.height[i, j])
    return HeightMap(
        time=old.time, cell=old.cell, pose=old.pose.copy(),
        height=np.where(known, old.height[i, j] + shift.z, np.nan),
        confidence=np.where(known, old.confidence[i, j], 0.0),
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Fit:
    """Where the refinement ended.

    Attributes:
        state: (6,) x, y (m), yaw (rad), z (m), slopes of the tilt.
        deviation: (3,) standard deviations of x, y (m) and yaw (rad); infinite where nothing tells them.
        misfit: m, root mean square of what is left.
    """

    state: FloatArray
    deviation: FloatArray
    misfit: float


class _Pair:
    """What two maps have in common: places that both know, with the newer one's heights.

    Args:
        old: the older map.
        new: the newer map.
    """

    def __init__(self, old: HeightMap, new: HeightMap) -> None:
        self._old = old
        self._layers = _layers(old)
        layers = _layers(new)
        places = centres(new)
        there = bilinear(old, self._layers, places)
        both = np.isfinite(there).all(axis=-1) & np.isfinite(layers).all(axis=-1)
        self.overlap = int(np.count_nonzero(both))
        self.places = places[both]
        self._height, self._slope = layers[both, 0], layers[both, 1:]
        self._before = there[both, 0]
        self.centre = self.places.mean(axis=0) if self.overlap else np.zeros(2)

    def level(self) -> float:
        """m, by how much the newer map is higher, in the middle."""
        return float(np.median(self._height - self._before))

    def residual(self, state: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Height differences after a shift, and how they change with it by either map's slopes.

        Args:
            state: (6,) x, y, yaw, z, slopes of the tilt.

        Returns:
            (k,) m, newer less older height, NaN where the older one is unknown; (k, 6) its derivatives by the
            older map's slopes, and (k, 6) by the newer one's.
        """
        back = _back(self.places, state[:3], self.centre)
        there = bilinear(self._old, self._layers, back)
        arm = self.places - self.centre
        left = self._height - there[:, 0] - state[3] - arm @ state[4:]
        c, s = math.cos(state[2]), math.sin(state[2])
        old_slope = there[:, 1:] @ np.array(((c, s), (-s, c)))
        turned = arm - state[:2]
        across = np.column_stack((-turned[:, 1], turned[:, 0]))
        level = np.column_stack((-np.ones(len(arm)), -arm))
        old, new = (
            np.column_stack((slope, np.einsum("ij,ij->i", slope, across), level))
            for slope in (old_slope, self._slope)
        )
        return left, old, new

    def cost(self, state: FloatArray, limit: float) -> float:
        """m², mean of squared differences about their median, none counted beyond a limit (m)."""
        back = _back(self.places[::_EVERY], state[:3], self.centre)
        left = self._height[::_EVERY] - bilinear(self._old, self._layers[..., :1], back)[:, 0]
        left = left[np.isfinite(left)]
        if len(left) == 0:
            return math.inf
        return float(np.minimum((left - np.median(left)) ** 2, limit**2).mean())


def _layers(ground: HeightMap) -> FloatArray:
    """(n, m, 3) heights (m) and slopes along the odometry frame's axes, as they are there."""
    forward, left = slopes(ground.height, ground.cell)
    c, s = math.cos(ground.pose[3]), math.sin(ground.pose[3])
    return np.stack((ground.height + ground.pose[2], c * forward - s * left, s * forward + c * left), axis=-1)


def _back(places: FloatArray, state: FloatArray, centre: FloatArray) -> FloatArray:
    """(..., 2) m, where places of the newer map are on the older one.

    Args:
        places: (..., 2) m, odometry frame.
        state: (3,) x, y (m) and yaw (rad) of the shift.
        centre: (2,) m, what it turns about.
    """
    c, s = math.cos(state[2]), math.sin(state[2])
    return np.asarray((places - centre - state[:2]) @ np.array(((c, -s), (s, c))) + centre)


def _coarse(pair: _Pair, bounds: Bounds) -> FloatArray:
    """(6,) the best of a grid of shifts within bounds, to start from."""
    shifts = _ladder(bounds.shift, bounds.step)
    turns = np.radians(_ladder(bounds.turn_deg, bounds.step_deg))
    grid = np.stack(np.meshgrid(shifts, shifts, turns, indexing="ij"), axis=-1).reshape(-1, 3)
    state = np.zeros(_PARAMETERS)
    state[:3] = min(grid, key=lambda start: pair.cost(start, 2.0 * bounds.misfit))
    state[3] = pair.level()
    return state


def _ladder(limit: float, step: float) -> FloatArray:
    """(2 k + 1,) steps from -limit to limit through 0, as even as can be."""
    return np.linspace(-limit, limit, 2 * max(1, round(limit / step)) + 1)


def _refined(pair: _Pair, start: FloatArray, bounds: Bounds) -> _Fit:
    """Gauss-Newton with Tukey's weights from a start on.

    How sure the result is comes from products of the two maps' slopes: the noise of one knows nothing of the
    other's, so that it does not pass for features, as it would in the squares of one map's slopes.
    """
    state = start.copy()
    limit = np.radians(bounds.tilt_deg)
    normal, noise = np.zeros((_PARAMETERS, _PARAMETERS)), math.inf
    for _ in range(bounds.iterations + 1):
        left, old, new = pair.residual(state)
        known = np.isfinite(left) & np.isfinite(old).all(axis=1)
        left, old, new = left[known], old[known], new[known]
        weight = np.maximum(1.0 - (left / (4.0 * bounds.misfit)) ** 2, 0.0) ** 2
        if weight.sum() < bounds.overlap / 2:
            break
        noise = math.sqrt(float((weight * left * left).sum() / weight.sum()))
        normal = (old * weight[:, None]).T @ new
        slope = 0.5 * (old + new)  # of both: the same whichever map is taken to be the older
        weighted = slope * weight[:, None]
        prior = np.diag((0.0, 0.0, 0.0, 0.0, *((noise / limit) ** 2,) * 2))
        hessian = weighted.T @ slope + prior + 1e-9 * np.eye(_PARAMETERS)
        state = state - np.linalg.solve(hessian, weighted.T @ left + prior @ state)
    return _Fit(state, _deviation(normal, noise), noise)


def _deviation(normal: FloatArray, noise: float) -> FloatArray:
    """(3,) standard deviations of x, y (m) and yaw (rad); infinite where the slopes do not tell them.

    Args:
        normal: (6, 6) weighted products of the older and the newer map's derivatives.
        noise: m, of a height difference.
    """
    information = 0.5 * (normal + normal.T)
    values = np.linalg.eigvalsh(information)
    if not np.isfinite(noise) or values[0] <= 1e-9 * max(float(values[-1]), 1e-9):
        return np.full(3, np.inf)
    variance = np.linalg.inv(information).diagonal()[:3] * (noise * noise * _CORRELATED)
    return np.asarray(np.sqrt(variance))


def _doubt(fit: _Fit, bounds: Bounds) -> str:
    """Why a fit is not believed; empty where it is."""
    x, y, yaw, z = fit.state[:4].tolist()
    if not np.isfinite(fit.state).all() or not math.isfinite(fit.misfit):
        return "the maps do not fit anywhere within bounds"
    if fit.deviation[:2].max() > bounds.sure or fit.deviation[2] > math.radians(bounds.sure_deg):
        return "the ground is too even to tell a shift"
    if max(abs(x), abs(y)) > bounds.shift or abs(yaw) > math.radians(bounds.turn_deg):
        return "the best fit lies beyond what the odometry can have drifted"
    if abs(z) > bounds.height:
        return "the maps' heights differ by more than the odometry can have drifted"
    return ""
