"""How near the robot is to what stands about it, and what it touches."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.sim.worlds.build import THING_GROUP
from bluefoot_mpc.types import FloatArray

REACH = 2.0
"""m; what is farther away counts as infinitely far."""

_Geoms = NDArray[np.intp]


class Surroundings:
    """Distances and contacts between the robot and all geoms of the things' group, fixed or moving.

    A thing is looked at closely only when the box around it is nearer than what was found so far, and of
    the robot only the parts whose bounding spheres are.

    Attributes:
        exist: False where nothing stands in the world.

    Args:
        model: MuJoCo model.
        data: its state, kinematics up to date.
        trunk: body of the robot's trunk.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, trunk: int) -> None:
        self._model, self._data, self._trunk = model, data, trunk
        own = model.body_rootid[model.geom_bodyid] == trunk
        solid = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
        self._parts: _Geoms = np.flatnonzero(own & solid)
        self._things: _Geoms = np.flatnonzero(~own & (model.geom_group == THING_GROUP))
        self.exist = bool(len(self._things))
        self._radii = model.geom_rbound[self._parts]
        self._centres = model.geom_aabb[self._things, :3]
        self._halves = model.geom_aabb[self._things, 3:]
        self._is_part, self._is_thing = (np.zeros(model.ngeom, dtype=bool) for _ in range(2))
        self._is_part[self._parts], self._is_thing[self._things] = True, True

    def clearance(self) -> float:
        """Distance from any part of the robot to the nearest thing, m.

        Negative where they overlap, infinite beyond `REACH`, NaN where nothing stands in the world.
        """
        if not self.exist:
            return math.nan
        data = self._data
        parts = data.geom_xpos[self._parts]
        middle = data.xpos[self._trunk]
        radius = float((np.sqrt(((parts - middle) ** 2).sum(axis=1)) + self._radii).max())
        least = self._to_boxes(middle) - radius
        best = REACH
        for thing in np.argsort(least):
            if least[thing] >= best:
                break
            best = self._to_thing(int(thing), parts, best)
        return best if best < REACH else math.inf

    def touched(self) -> tuple[str, ...]:
        """Names of the things that the robot touches in MuJoCo's present contacts."""
        data = self._data
        if not self.exist or not data.ncon:
            return ()
        pairs = data.contact.geom
        ours = self._is_part[pairs].any(axis=1) & self._is_thing[pairs].any(axis=1)
        if not ours.any():
            return ()
        geoms = pairs[ours]
        return tuple(self._name(int(geom)) for geom in np.unique(geoms[self._is_thing[geoms]]))

    def _to_thing(self, thing: int, parts: FloatArray, best: float) -> float:
        """The lesser of a distance found so far and the robot's to one thing, m."""
        geom = int(self._things[thing])
        rotation = self._data.geom_xmat[geom].reshape(3, 3)
        local = (parts - self._data.geom_xpos[geom]) @ rotation - self._centres[thing]
        least = _outside(np.abs(local) - self._halves[thing]) - self._radii
        for part in np.argsort(least):
            if least[part] >= best:
                break
            other = int(self._parts[part])
            found = mujoco.mj_geomDistance(self._model, self._data, other, geom, max(best, 0.0), None)
            best = min(best, found)
        return best

    def _to_boxes(self, point: FloatArray) -> FloatArray:
        """Distance of a point in world to the box around each thing (n,), m; zero inside."""
        data = self._data
        offset = point - data.geom_xpos[self._things]
        rotation = data.geom_xmat[self._things].reshape(-1, 3, 3)
        local = (offset[:, None, :] @ rotation)[:, 0] - self._centres
        return _outside(np.abs(local) - self._halves)

    def _name(self, geom: int) -> str:
        """Of the geom, or of its body where it has none."""
        name = self._model.geom(geom).name
        return str(name or self._model.body(self._model.geom_bodyid[geom]).name or f"geom {geom}")


def _outside(excess: FloatArray) -> FloatArray:
    """(n,) m, length of what (n, 3) coordinates exceed a box by."""
    return np.asarray(np.sqrt((np.maximum(excess, 0.0) ** 2).sum(axis=1)))
