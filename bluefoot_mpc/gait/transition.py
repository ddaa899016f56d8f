"""From one gait to another while walking: a line from trot (0) over a midway gait to walk (1).

The two halves of the way do different things. First swings become as short as
the walk's, in the trot's order; then the coupling changes, and from there on
the lift-off gate keeps three feet down, which parts the diagonal pairs within
one cycle (front leg first). Blending everything at once makes legs stall for
two to three cycles, stretched far behind: the walk's coupling is far from
balance at the trot's phases and outweighs its small α. The way back takes the
same steps in reverse.
"""

from __future__ import annotations

import math

from bluefoot_mpc.gait.calibration import LimitCycle, Rhythm, calibrate, mix
from bluefoot_mpc.gait.config import GaitConfig
from bluefoot_mpc.gait.couplings import TROT, WALK, coupling

NODE_SPACING = 0.04
"""Farthest that calibrated swing shares lie apart: between them, mixtures are right to 1e-3."""
RESOLUTION = 1.0 / 1024.0
"""Steps of the swing share at run time, so that few rhythms have to be mixed."""

PLACES = {TROT.name: 0.0, WALK.name: 1.0}


def place_of(name: str) -> float:
    """Place of a named gait on the line.

    Raises:
        UnknownNameError: there is no such gait.
    """
    return PLACES[coupling(name).name]


class Transition:
    """Rhythm anywhere between trot and walk.

    Args:
        config: everything that shapes the gait.

    Raises:
        ConfigurationError: the network cannot give a wanted swing share.
    """

    def __init__(self, config: GaitConfig) -> None:
        trot, walk = _shares(TROT.name, config), _shares(WALK.name, config)
        self.trot = RhythmFamily(TROT.name, config, trot)
        self.middle = RhythmFamily(TROT.name, config, walk)
        self.walk = RhythmFamily(WALK.name, config, walk)

    def cycle(self, place: float, shares: tuple[float, float]) -> LimitCycle:
        """Limit cycle of the named gait nearest to `place`, calibrated nearest to its share."""
        return self.trot.nearest(shares[0]) if place < 0.5 else self.walk.nearest(shares[1])

    def rhythm(self, place: float, shares: tuple[float, float]) -> Rhythm:
        """Rhythm at `place` in [0, 1], with the swing shares wanted of trot and walk."""
        if place <= 0.0:
            return self.trot.at(shares[0])
        if place >= 1.0:
            return self.walk.at(shares[1])
        middle = self.middle.at(shares[1])
        if place <= 0.5:
            return mix(self.trot.at(shares[0]), middle, 2.0 * place)
        return mix(middle, self.walk.at(shares[1]), 2.0 * place - 1.0)

    @staticmethod
    def least_stance(place: float) -> int:
        """Fewest feet on the ground."""
        return TROT.least_stance if place < 0.5 else WALK.least_stance


class RhythmFamily:
    """One gait's rhythms over the swing share, calibrated at nodes and mixed between them.

    Args:
        name: name of the gait.
        config: everything that shapes the gait.
        shares: swing shares that will be asked for; their least and largest bound them.

    Raises:
        ConfigurationError: the network cannot give one of them.
    """

    def __init__(self, name: str, config: GaitConfig, shares: tuple[float, ...]) -> None:
        gain = config.timing(name).coupling_gain
        low, high = min(shares), max(shares)
        count = max(1, math.ceil((high - low) / NODE_SPACING - 1e-9))
        self._nodes = [low + (high - low) * k / count for k in range(count + 1)] if high > low else [low]
        self._cycles = [calibrate(coupling(name), gain, share, config.cpg) for share in self._nodes]
        self._known: dict[int, Rhythm] = {}

    def nearest(self, share: float) -> LimitCycle:
        """The calibrated limit cycle whose share is nearest."""
        return min(zip(self._nodes, self._cycles, strict=True), key=lambda item: abs(item[0] - share))[1]

    def at(self, share: float) -> Rhythm:
        """The rhythm with a swing share, to `RESOLUTION`."""
        if len(self._nodes) == 1:
            return self._cycles[0].rhythm
        key = round(share / RESOLUTION)
        rhythm = self._known.get(key)
        if rhythm is None:
            rhythm = self._known[key] = self._mixed(key * RESOLUTION)
        return rhythm

    def _mixed(self, share: float) -> Rhythm:
        nodes, last = self._nodes, len(self._nodes) - 1
        k = 1
        while k < last and share > nodes[k]:
            k += 1
        weight = min(1.0, max(0.0, (share - nodes[k - 1]) / (nodes[k] - nodes[k - 1])))
        return mix(self._cycles[k - 1].rhythm, self._cycles[k].rhythm, weight)


def _shares(name: str, config: GaitConfig) -> tuple[float, ...]:
    return config.table(name).swing_share or (config.timing(name).swing_share,)
