"""The power table with its run times, and what a run really drew (paper, power budget).

The paper adds up to 133.825 W and counts 4 W of regulation and radio losses on
top. Its 41 and 28 minutes pool both packs; the nets are separate on the robot,
so the servos' own pack decides sooner, and both figures are reported.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.parameters import PowerParameters
from bluefoot_mpc.types import FloatArray

ELECTRONICS_NET = 1
SERVO_NET = 2

_SECONDS_PER_HOUR = 3600.0


@dataclass(frozen=True, kw_only=True, slots=True)
class PowerRow:
    """One consumer of the table."""

    name: str
    net: int
    voltage: float  # V
    current: float  # A
    power: float  # W


@dataclass(frozen=True, kw_only=True, slots=True)
class NetBudget:
    """One supply net with its own packs, losses left out."""

    net: int
    power: float  # W
    capacity: float  # Wh
    run_time: float  # min, at that power


@dataclass(frozen=True, kw_only=True, slots=True)
class PowerBudget:
    """The whole table.

    Attributes:
        rows: consumers in the order of the parameter file.
        nets: nets in rising order.
        load: W, sum of the rows.
        losses: W, regulation and radio.
        nominal: W, load and losses.
        worst: W, the worst case that the paper states.
        capacity: Wh, all packs.
        nominal_run_time: min, packs pooled.
        worst_run_time: min, packs pooled.
    """

    rows: tuple[PowerRow, ...]
    nets: tuple[NetBudget, ...]
    load: float
    losses: float
    nominal: float
    worst: float
    capacity: float
    nominal_run_time: float
    worst_run_time: float


@dataclass(frozen=True, kw_only=True, slots=True)
class BatteryUse:
    """What a run drew, and how long the packs would last at that rate.

    Attributes:
        duration: s.
        servo_energy: J, by the servos.
        electronics_energy: J, computers, sensors and losses at their nominal power.
        energy: J, all together.
        servo_mean_power: W.
        servo_peak_power: W, highest sample.
        mean_power: W, servos, electronics and losses.
        charge_share: of all packs' energy, 0..1 (above 1: more than they hold).
        pooled_run_time: min at the mean power, packs pooled.
        servo_run_time: min at the servos' mean power from their own packs; inf when they drew nothing.
    """

    duration: float
    servo_energy: float
    electronics_energy: float
    energy: float
    servo_mean_power: float
    servo_peak_power: float
    mean_power: float
    charge_share: float
    pooled_run_time: float
    servo_run_time: float


def power_budget(power: PowerParameters) -> PowerBudget:
    """The power table and run times of a robot's parameters."""
    rows = tuple(
        PowerRow(name=p.name, net=p.net, voltage=p.voltage, current=p.current, power=p.voltage * p.current)
        for p in power.loads
    )
    nets = tuple(
        _net_budget(power, rows, net)
        for net in sorted({row.net for row in rows} | {pack.net for pack in power.packs})
    )
    load = sum(row.power for row in rows)
    capacity = _capacity(power)
    nominal = load + power.losses
    return PowerBudget(
        rows=rows, nets=nets, load=load, losses=power.losses, nominal=nominal, worst=power.worst_case,
        capacity=capacity, nominal_run_time=_minutes(capacity, nominal),
        worst_run_time=_minutes(capacity, power.worst_case),
    )  # fmt: skip


def energy_report(power: PowerParameters, time: FloatArray, servo_power: FloatArray) -> BatteryUse:
    """Integrate the servos' electrical power of a run and project how long the packs last.

    Args:
        power: the robot's power parameters; computers, sensors and losses are
            taken from its table, since a run does not change them.
        time: (n,) s, rising, n >= 2.
        servo_power: (n,) W, drawn by all servos together.

    Raises:
        ConfigurationError: the samples do not fit, are not finite or do not rise in time.
    """
    if time.shape != servo_power.shape or time.ndim != 1 or len(time) < 2:
        shapes = f"time {time.shape}, power {servo_power.shape}"
        raise ConfigurationError(
            f"a power record takes two rows of equal length, two samples at least: {shapes}"
        )
    if not (np.isfinite(time).all() and np.isfinite(servo_power).all() and (np.diff(time) > 0.0).all()):
        raise ConfigurationError("a power record must be finite and its time must rise")
    duration = float(time[-1] - time[0])
    servo_energy = float(np.trapezoid(servo_power, time))
    constant = sum(p.voltage * p.current for p in power.loads if p.net != SERVO_NET) + power.losses
    energy = servo_energy + constant * duration
    capacity = _capacity(power)
    return BatteryUse(
        duration=duration,
        servo_energy=servo_energy,
        electronics_energy=constant * duration,
        energy=energy,
        servo_mean_power=servo_energy / duration,
        servo_peak_power=float(servo_power.max()),
        mean_power=energy / duration,
        charge_share=energy / (capacity * _SECONDS_PER_HOUR),
        pooled_run_time=_minutes(capacity, energy / duration),
        servo_run_time=_minutes(_capacity(power, SERVO_NET), servo_energy / duration),
    )


def _net_budget(power: PowerParameters, rows: tuple[PowerRow, ...], net: int) -> NetBudget:
    drawn = sum(row.power for row in rows if row.net == net)
    capacity = _capacity(power, net)
    return NetBudget(net=net, power=drawn, capacity=capacity, run_time=_minutes(capacity, drawn))


def _capacity(power: PowerParameters, net: int | None = None) -> float:
    """Wh of all packs, or of those of one net."""
    return sum(pack.voltage * pack.capacity_ah for pack in power.packs if net in (None, pack.net))


def _minutes(capacity: float, power: float) -> float:
    """Run time of `capacity` (Wh) at `power` (W), min; inf when nothing is drawn."""
    return 60.0 * capacity / power if power > 0.0 else float("inf")
