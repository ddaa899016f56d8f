"""The levelling ablation on made-up runs: rows, comparisons, and what earns the network its credit."""

import itertools

import pytest

from bluefoot_mpc.evaluation import battery as battery_module
from bluefoot_mpc.evaluation import level_parts as parts_module
from bluefoot_mpc.evaluation.battery import Store
from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.level_ablation import (
    SHOWN,
    ablate_leveling,
    credits_of,
    level_criteria,
    missing_level_runs,
)
from bluefoot_mpc.evaluation.level_cases import DEFAULT_CASES, chosen_level_cases, level_cases
from bluefoot_mpc.evaluation.level_measure import leveling_figures
from bluefoot_mpc.evaluation.level_parts import LEVEL_PARTS, level_parts
from bluefoot_mpc.evaluation.measure import measure
from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.registry import find_scenario

TILTS = {"mix": 3.8, "pd": 2.0, "narx": 1.6, "always": 1.7, "network": 3.7, "persistence": 1.9, "model": 2.1}
"""Tilt (degrees) that each part leaves of four."""


@pytest.fixture
def tilts():
    return dict(TILTS)


@pytest.fixture
def ran(monkeypatch, tilts):
    seen = []

    def measured(case, seed):
        seen.append((case, seed))
        overrides = case.options["overrides"]
        (part,) = [p.name for p in LEVEL_PARTS if set(p.overrides("cpg")[:3]) <= set(overrides)]
        on = tilts[part] * (1.0 + 0.01 * seed)
        figures = dict.fromkeys(SHOWN, 0.0)
        lower = 100.0 * (1.0 - on / 4.0)
        figures |= {f"{axis}_reduction_percent": lower for axis in ("roll", "pitch", "tilt")}
        figures |= {f"on_{axis}_rms_deg": on for axis in ("roll", "pitch", "tilt")}
        return {"falls": 0.0, "disengaged": 0.0, **figures}

    monkeypatch.setattr(battery_module, "measure", measured)
    return seen


def ablated(*names, seeds=5, parts=(), duration=None, store=None):
    cases = chosen_level_cases(names or ("level-60",), seeds, duration)
    return ablate_leveling(cases, level_parts(parts), store or Store(None), workers=1)


def test_every_part_meets_the_same_seeds_and_the_two_rivals_of_the_network(ran):
    rows = ablated(seeds=5, duration=44.0)
    assert [row.part.name for row in rows] == list(TILTS)
    assert len(ran) == 5 * len(TILTS)
    assert {case.options["duration"] for case, _ in ran} == {44.0}
    found = {row.part.name: row for row in rows}
    assert set(found["narx"].against) == {"pd", "persistence"}
    assert set(found["pd"].against) == {"persistence"}
    ratio = found["narx"].against["pd"]["on_tilt_rms_deg"].ratio
    assert (ratio.low, ratio.value, ratio.high) == pytest.approx((0.8, 0.8, 0.8))
    plain = found["narx"].as_plain()
    assert plain["figures"]["tilt_reduction_percent"]["median"] == pytest.approx(100.0 * (1 - 1.6 * 1.02 / 4))
    assert plain["against"]["persistence"]["on_tilt_rms_deg"]["pairs"] == 5


def test_rows_that_mean_nothing_under_model_based_control_are_not_run(ran):
    rows = ablated("level-mpc-60")
    assert [row.part.name for row in rows] == ["pd", "narx", "always", "persistence", "model"]
    assert {case.options["controller"] for case, _ in ran} == {"mpc"}


def test_a_case_without_any_of_the_rows_is_refused(ran):
    message = (
        "'level-mpc-60' has nothing to run: mix, network is not measured under mpc. Take some of: pd, narx"
    )
    with pytest.raises(ConfigurationError, match=message):
        ablated("level-60", "level-mpc-60", parts=("mix", "network"))
    with pytest.raises(ConfigurationError, match=message):
        missing_level_runs(level_cases(), level_parts(("mix", "network")), Store(None))
    assert ran == []


@pytest.mark.parametrize(
    ("changes", "seeds", "verdict"),
    [
        ({}, 5, "credited"),
        ({"narx": 1.81}, 5, "no better than pd"),
        ({"persistence": 1.7}, 5, "no better than persistence"),
        ({"narx": 4.2, "pd": 6.0, "persistence": 6.0}, 5, "does harm"),
        ({}, 4, "too few runs"),
    ],
)
def test_the_network_is_credited_only_where_it_clearly_beats_both(ran, tilts, changes, seeds, verdict):
    tilts |= changes
    (credit,) = credits_of(ablated(seeds=seeds))
    assert credit["verdict"] == verdict
    assert credit["credited"] == (verdict == "credited")


def test_a_mean_that_hangs_on_a_few_robots_earns_no_credit(ran, monkeypatch):
    measured = battery_module.measure

    def scattered(case, seed):
        figures = measured(case, seed)
        if "control.leveling.psi=network" in case.options["overrides"]:
            figures["on_tilt_rms_deg"] = (0.5, 2.4, 0.6, 2.6, 2.4)[seed]
        return figures

    monkeypatch.setattr(battery_module, "measure", scattered)
    (credit,) = credits_of(ablated())
    ratio = credit["against"]["pd"]["ratio"]
    assert ratio["value"] < 0.9
    assert ratio["high"] > 1.0
    assert not credit["credited"]


def test_without_its_rivals_the_network_is_not_judged(ran):
    assert credits_of(ablated(parts=("narx", "pd"))) == []


def test_levelling_as_delivered_is_judged_by_its_cases(ran):
    judged = {row["figure"]: row for row in level_criteria(ablated())}
    assert judged["roll_reduction_percent"]["holds"]
    assert judged["roll_reduction_percent"]["limit"] == "median ≥ 50 %"
    assert {"falls", "disengaged", "speed_change_percent", "height_change_mm"} <= judged.keys()
    assert level_criteria(ablated(parts=("pd",))) == []


def test_runs_that_fell_are_counted_and_left_out(ran, monkeypatch):
    measured = battery_module.measure
    monkeypatch.setattr(
        battery_module, "measure", lambda case, seed: {**measured(case, seed), "falls": float(seed == 4)}
    )
    row = ablated(parts=("pd",))[0].as_plain()
    assert row["falls"] == 1
    assert row["runs"] == 5
    assert row["figures"]["on_tilt_rms_deg"]["max"] == pytest.approx(2.0 * 1.03)


def test_what_is_known_is_not_run_again(ran):
    store, cases = Store(None), chosen_level_cases(["level-80"], 2, None)
    assert missing_level_runs(cases, LEVEL_PARTS, store) == 2 * len(TILTS)
    ablated("level-80", seeds=2, store=store)
    assert missing_level_runs(cases, LEVEL_PARTS, store) == 0


def test_gains_of_a_row_reach_its_runs_and_no_others(ran, monkeypatch):
    tuned = {"cpg": {"pd": ("control.leveling.gains.tilt=1234.0",)}}
    monkeypatch.setattr(parts_module, "TUNED", tuned)
    ablated("level-friction", "level-servos", seeds=1)
    for case, _ in ran:
        overrides = case.options["overrides"]
        is_pd = {"control.leveling.psi=zero", "control.leveling.attitude=true"} <= set(overrides)
        assert (tuned["cpg"]["pd"][0] in overrides) == is_pd


@pytest.mark.parametrize("name", list(level_cases()))
def test_every_run_of_a_case_is_a_configuration(name):
    (case,) = chosen_level_cases([name], 1, None).values()
    for part in LEVEL_PARTS:
        own = part.overrides(case.options["controller"])
        options = {**case.options, "overrides": (*case.options.get("overrides", ()), *own)}
        resolved = resolve(find_scenario(case.scenario), RunOptions(**options))
        leveling = resolved.stages.control.leveling
        assert (leveling.enabled, leveling.attitude, leveling.psi) == (True, part.attitude, part.psi)
        assert leveling.mix == case.options.get("level_mix", 0.25)


def test_cases_have_names_of_their_own_and_the_chosen_ones_exist():
    cases = level_cases()
    assert len({case.name for case in cases.values()}) == len(cases) == 20
    assert set(DEFAULT_CASES) <= cases.keys()
    for first, second in itertools.combinations(cases.values(), 2):
        assert first.options != second.options


def test_what_cannot_be_run_is_refused():
    with pytest.raises(UnknownNameError, match="level-60"):
        chosen_level_cases(["level-61"], 1, None)
    with pytest.raises(ConfigurationError, match="take 34 or more"):
        chosen_level_cases(["level-60"], 1, 33.0)
    with pytest.raises(UnknownNameError, match="persistence"):
        level_parts(("persistance",))


def test_a_simulated_run_gives_every_figure_of_the_table():
    schedule = {"start": 4, "off": 2, "on": 2}
    overrides = tuple(f"control.leveling.schedule.{key}={value}" for key, value in schedule.items())
    options = {"controller": "cpg", "level": "pd", "duration": 8.5, "overrides": overrides}
    found = measure(Case(name="short", scenario="level", options=options), 0)
    assert set(SHOWN) <= found.keys()
    assert found["tilt_reduction_percent"] > 20.0
    assert found["tilt_reduction_1_percent"] == pytest.approx(found["tilt_reduction_percent"])
    assert found["tilt_reduction_2_percent"] is None
    assert found["disengaged"] == 0.0


def test_other_runs_have_no_figures_of_levelling():
    assert leveling_figures({"window_s": None}) == {}
