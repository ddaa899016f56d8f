import dataclasses
import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.model.power import SERVO_NET, energy_report, power_budget

POWER = load_parameters().power


def test_power_table_of_the_paper():
    budget = power_budget(POWER)
    assert budget.load == pytest.approx(133.825, abs=1e-9)
    assert budget.nominal == pytest.approx(137.825, abs=1e-9)
    assert budget.worst == 200.0
    assert budget.capacity == pytest.approx(96.0)
    assert sum(row.power for row in budget.rows) == pytest.approx(budget.load)
    assert {row.name: row.power for row in budget.rows}["AX-12A servos"] == pytest.approx(115.2)


def test_run_times_of_the_paper_pool_both_packs():
    budget = power_budget(POWER)
    assert math.floor(budget.nominal_run_time) == 41
    assert budget.nominal_run_time == pytest.approx(41.8, abs=0.05)
    assert math.floor(budget.worst_run_time) == 28
    assert budget.worst_run_time == pytest.approx(28.8, abs=0.05)


def test_each_net_runs_on_its_own_packs():
    electronics, servos = power_budget(POWER).nets
    assert servos.net == SERVO_NET
    assert servos.run_time == pytest.approx(37.5)
    assert electronics.power == pytest.approx(18.625)
    assert electronics.run_time == pytest.approx(60.0 * 24.0 / 18.625)


def test_constant_draw_gives_the_tables_run_times():
    time = np.linspace(3.0, 13.0, 501)
    use = energy_report(POWER, time, np.full_like(time, 115.2))
    assert use.duration == pytest.approx(10.0)
    assert use.servo_energy == pytest.approx(1152.0)
    assert use.electronics_energy == pytest.approx(226.25)
    assert use.mean_power == pytest.approx(137.825)
    assert use.pooled_run_time == pytest.approx(power_budget(POWER).nominal_run_time)
    assert use.servo_run_time == pytest.approx(37.5)
    assert use.charge_share == pytest.approx(1378.25 / (96.0 * 3600.0))


def test_changing_draw_is_integrated_over_uneven_samples():
    time = np.sort(np.random.default_rng(1).uniform(0.0, 5.0, 4000))
    use = energy_report(POWER, time, 20.0 + 10.0 * np.sin(time))
    a, b = time[0], time[-1]
    assert use.servo_energy == pytest.approx(20.0 * (b - a) + 10.0 * (np.cos(a) - np.cos(b)), rel=1e-5)
    assert use.servo_mean_power == pytest.approx(use.servo_energy / (b - a))
    assert use.servo_peak_power == pytest.approx(30.0, abs=0.01)
    assert use.energy == use.servo_energy + use.electronics_energy


def test_idle_servos_never_empty_their_pack():
    use = energy_report(POWER, np.array([0.0, 1.0]), np.zeros(2))
    assert use.servo_run_time == math.inf
    assert use.pooled_run_time == pytest.approx(60.0 * 96.0 / 22.625)


@pytest.mark.parametrize(
    ("time", "power"),
    [
        ([0.0], [1.0]),
        ([0.0, 1.0], [1.0, 2.0, 3.0]),
        ([0.0, 1.0, 1.0], [1.0, 2.0, 3.0]),
        ([0.0, 1.0], [1.0, np.nan]),
    ],
)
def test_records_that_cannot_be_integrated_are_refused(time, power):
    with pytest.raises(ConfigurationError, match="power record"):
        energy_report(POWER, np.array(time), np.array(power))


def test_other_loads_change_the_budget():
    servos = [dataclasses.replace(load, current=4.8) if load.net == 2 else load for load in POWER.loads]
    budget = power_budget(dataclasses.replace(POWER, loads=tuple(servos)))
    assert budget.load == pytest.approx(133.825 - 57.6)
    assert budget.nets[1].run_time == pytest.approx(75.0)
