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

from bluefoot_mpc.gait.calibration import LimitCycle, Rhythm, calibrate, mix
from bluefoot_mpc.gait.config import GaitConfig
from bluefoot_mpc.gait.couplings import TROT, WALK, coupling
from bluefoot_mpc.gait.timing import cycle_time, step_height

PLACES = {TROT.name: 0.0, WALK.name: 1.0}


def place_of(name: str) -> float:
    """Place of a named gait on the line.

    Raises:
        UnknownNameError: there is no such gait.
    """
    return PLACES[coupling(name).name]


class Transition:
    """Rhythm, cycle time and step height anywhere between trot and walk.

    Args:
        config: everything that shapes the gait.

    Raises:
        ConfigurationError: the network cannot give a wanted swing share.
    """

    def __init__(self, config: GaitConfig) -> None:
        self._ends = (config.trot, config.walk)
        self.trot = _calibrated(TROT.name, config, config.trot.swing_share)
        self.middle = _calibrated(TROT.name, config, config.walk.swing_share)
        self.walk = _calibrated(WALK.name, config, config.walk.swing_share)

    def cycle(self, place: float) -> LimitCycle:
        """Limit cycle of the named gait nearest to `place`."""
        return self.trot if place < 0.5 else self.walk

    def rhythm(self, place: float) -> Rhythm:
        """Rhythm at `place` in [0, 1]."""
        if place <= 0.0:
            return self.trot.rhythm
        if place >= 1.0:
            return self.walk.rhythm
        if place <= 0.5:
            return mix(self.trot.rhythm, self.middle.rhythm, 2.0 * place)
        return mix(self.middle.rhythm, self.walk.rhythm, 2.0 * place - 1.0)

    def cycle_time(self, place: float, speed: float, yaw_rate: float) -> float:
        """Wanted cycle time, s."""
        trot, walk = self._ends
        if place <= 0.0:
            return cycle_time(speed, yaw_rate, trot)
        slow = cycle_time(speed, yaw_rate, walk)
        return slow if place >= 1.0 else slow + (1.0 - place) * (cycle_time(speed, yaw_rate, trot) - slow)

    def step_height(self, place: float, speed: float, yaw_rate: float) -> float:
        """Step height, m."""
        trot, walk = self._ends
        return (1.0 - place) * step_height(speed, yaw_rate, trot) + place * step_height(speed, yaw_rate, walk)

    @staticmethod
    def least_stance(place: float) -> int:
        """Fewest feet on the ground."""
        return TROT.least_stance if place < 0.5 else WALK.least_stance


def _calibrated(name: str, config: GaitConfig, share: float) -> LimitCycle:
    return calibrate(coupling(name), config.timing(name).coupling_gain, share, config.cpg)
