"""What of the gait follows its speed: the table's columns, or what holds without them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from bluefoot_mpc.gait.footholds import FootholdConfig, SwingShape
from bluefoot_mpc.gait.table import GaitTable, Law, Vertical, interpolator
from bluefoot_mpc.gait.timing import GaitTiming, cycle_time, step_height


class Style(NamedTuple):
    """What the table says about the trunk; later stages apply it.

    Attributes:
        trunk_height: m, trunk origin above the foot points; NaN when nobody said.
        trunk_forward: m, trunk origin ahead of the middle of the feet.
        ankle_shift: rad, added to the ankle direction.
        level_gain: 1/s, slow integral levelling.
        mixing: share of the planned torque that the goals feed forward.
        back_emf: share of what back-EMF takes at the planned speed.
    """

    trunk_height: float = math.nan
    trunk_forward: float = 0.0
    ankle_shift: float = 0.0
    level_gain: float = 0.0
    mixing: float = 0.0
    back_emf: float = 0.0


class Parameters(NamedTuple):
    """All parameters at one place between the gaits and one speed.

    Attributes:
        cycle_time: s.
        shares: shares of the cycle in swing that trot and walk want.
        step_height: m.
        shape: how feet that lift now swing.
        nominal: (4,) nominal feet in b', x + iy, m.
        style: what later stages apply.
    """

    cycle_time: float
    shares: tuple[float, float]
    step_height: float
    shape: SwingShape
    nominal: tuple[complex, ...]
    style: Style


@dataclass(frozen=True, kw_only=True, slots=True)
class Basis:
    """What columns left empty fall back on.

    Attributes:
        foothold: swing of the feet.
        nominal: (4,) nominal feet in b', x + iy, m.
        style: trunk.
    """

    foothold: FootholdConfig
    nominal: tuple[complex, ...]
    style: Style


STEP = 2e-4
"""m/s and rad/s; smaller changes of the command, those of its tracking, leave a table's parameters alone."""
NO_STYLE = Style()
"""Trunk parameters of a gait to which nobody told any."""

# Columns in the order of a row; the first three follow timing laws where they are empty.
_TIMING = ("cycle_time", "swing_share", "step_height")
_SHAPE = ("ground_matching", "apex", "swing_rate", "stance_lead")
_STANCE = ("stance_x", "stance_y")
_STYLE = Style._fields
COLUMNS = (*_TIMING, *_SHAPE, *_STANCE, *_STYLE)


class ParameterReader(Protocol):
    """Parameters between the gaits and over the speed."""

    def at(self, place: float, velocity: complex, yaw_rate: float) -> Parameters:
        """Parameters at `place` in [0, 1] (trot to walk) and a commanded twist (m/s, rad/s)."""
        ...


class LawReader:
    """Without a table: cycle time and step height by their laws, all else constant.

    Args:
        timings: laws of trot and walk.
        basis: what is constant.
    """

    def __init__(self, timings: tuple[GaitTiming, GaitTiming], basis: Basis) -> None:
        self._timings = timings
        self._shares = (timings[0].swing_share, timings[1].swing_share)
        self._rest = (SwingShape.of(basis.foothold), basis.nominal, basis.style)

    def at(self, place: float, velocity: complex, yaw_rate: float) -> Parameters:
        """Parameters at `place` in [0, 1] and a commanded twist."""
        speed, rate = abs(velocity), abs(yaw_rate)
        trot, walk = self._timings
        if place <= 0.0 or place >= 1.0:
            timing = trot if place <= 0.0 else walk
            cycle, height = cycle_time(speed, rate, timing), step_height(speed, rate, timing)
        else:
            height = (1.0 - place) * step_height(speed, rate, trot) + place * step_height(speed, rate, walk)
            cycle = cycle_time(speed, rate, walk)
            cycle += (1.0 - place) * (cycle_time(speed, rate, trot) - cycle)
        return Parameters(cycle, self._shares, height, *self._rest)


class TableReader:
    """Reads one gait's parameters as a row of numbers, and the words that go with it.

    Args:
        table: columns over speed.
        timing: laws for cycle time and step height where the table has none.
        basis: everything else.
    """

    def __init__(self, table: GaitTable, timing: GaitTiming, basis: Basis) -> None:
        self._table = table
        self._timing = timing
        self._lawful_cycle = not table.cycle_time
        self._lawful_height = not table.step_height
        knots = table.speed or (0.0,)
        fixed = self._fixed(basis)
        columns = [table.column(name) or (fixed[name],) * len(knots) for name in COLUMNS]
        self._read = interpolator(knots, list(zip(*columns, strict=True)))
        self._knots = knots
        self._laws: tuple[Law, ...] = table.column("law") or (basis.foothold.law,) * len(knots)
        self._verticals: tuple[Vertical, ...] = table.column("vertical") or (basis.foothold.vertical,) * len(
            knots
        )

    def _fixed(self, basis: Basis) -> dict[str, float]:
        foothold, nominal = basis.foothold, basis.nominal
        values = {name: float(getattr(foothold, name)) for name in _SHAPE}
        values |= {"cycle_time": self._timing.cycle_max, "swing_share": self._timing.swing_share}
        values |= {"step_height": self._timing.height_min}
        values["stance_x"] = 0.25 * sum(abs(foot.real) for foot in nominal)
        values["stance_y"] = 0.25 * sum(abs(foot.imag) for foot in nominal)
        return values | basis.style._asdict()

    def row(self, velocity: complex, yaw_rate: float) -> tuple[float, ...]:
        """Values of `COLUMNS` at a commanded twist."""
        row = self._read(self._table.effective_speed(velocity, yaw_rate))
        if self._lawful_cycle or self._lawful_height:
            cycle, share, height, *rest = row
            speed, rate = abs(velocity), abs(yaw_rate)
            if self._lawful_cycle:
                cycle = cycle_time(speed, rate, self._timing)
            if self._lawful_height:
                height = step_height(speed, rate, self._timing)
            return (cycle, share, height, *rest)
        return row

    def words(self, velocity: complex, yaw_rate: float) -> tuple[Law, Vertical]:
        """Swing law and vertical profile of the nearest knot."""
        speed = self._table.effective_speed(velocity, yaw_rate)
        knots, k = self._knots, 0
        while k + 1 < len(knots) and 2.0 * speed > knots[k] + knots[k + 1]:
            k += 1
        return self._laws[k], self._verticals[k]


class TablesReader:
    """Parameters from the tables of trot and walk.

    Args:
        tables: columns over speed.
        timings: laws for what they leave empty.
        basis: what else they leave empty.
    """

    def __init__(
        self, tables: tuple[GaitTable, GaitTable], timings: tuple[GaitTiming, GaitTiming], basis: Basis
    ) -> None:
        self._trot = TableReader(tables[0], timings[0], basis)
        self._walk = TableReader(tables[1], timings[1], basis)
        self._nominal = basis.nominal
        self._placed = any(table.stance_x or table.stance_y for table in tables)
        self._key: tuple[float, int, int, int] = (0.0, 0, 0, 0)
        self._signs = [(math.copysign(1.0, p.real), math.copysign(1.0, p.imag)) for p in basis.nominal]
        self._last = self._read(0.0, 0j, 0.0)

    def at(self, place: float, velocity: complex, yaw_rate: float) -> Parameters:
        """Parameters at `place` in [0, 1] and a commanded twist, in steps of `STEP`."""
        key = (place, round(velocity.real / STEP), round(velocity.imag / STEP), round(yaw_rate / STEP))
        if key != self._key:
            self._key = key
            self._last = self._read(place, complex(key[1] * STEP, key[2] * STEP), key[3] * STEP)
        return self._last

    def _read(self, place: float, velocity: complex, yaw_rate: float) -> Parameters:
        if place <= 0.0:
            first = row = self._trot.row(velocity, yaw_rate)
        elif place >= 1.0:
            first = row = self._walk.row(velocity, yaw_rate)
        else:
            first, row = self._trot.row(velocity, yaw_rate), self._walk.row(velocity, yaw_rate)
        shares = (first[1], row[1])
        if first is not row:
            row = tuple([a + place * (b - a) for a, b in zip(first, row, strict=True)])
        law, vertical = (self._trot if place < 0.5 else self._walk).words(velocity, yaw_rate)
        cycle, _, height, matching, apex, rate, lead, x, y, *style = row
        shape = SwingShape(law, vertical, matching, apex, rate, lead)
        nominal = self._nominal
        if self._placed:
            nominal = tuple([complex(a * x, b * y) for a, b in self._signs])
        return Parameters(cycle, shares, height, shape, nominal, Style(*style))


def parameter_reader(
    tables: tuple[GaitTable, GaitTable], timings: tuple[GaitTiming, GaitTiming], basis: Basis
) -> ParameterReader:
    """The reader for the tables of trot and walk; with two empty ones, the laws alone."""
    if all(table.empty for table in tables):
        return LawReader(timings, basis)
    return TablesReader(tables, timings, basis)
