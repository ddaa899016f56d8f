import pytest

from bluefoot_mpc.evaluation import battery as battery_module
from bluefoot_mpc.evaluation.batteries import BATTERIES, battery
from bluefoot_mpc.evaluation.battery import Store, Verdict, run_battery
from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.limits import Limit
from bluefoot_mpc.evaluation.tables import (
    as_plain,
    battery_line,
    limits_table,
    replace_between,
    walking_table,
)
from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.scenarios import RunOptions

CASE = Case(
    name="made up",
    scenario="stand",
    options={"duration": 1.0},
    seeds=(0, 1, 2),
    limits=(Limit(figure="falls", bound=0), Limit(figure="clearance_mm", bound=8.0, side="min", unit="mm")),
)


def made_up(case, seed):
    return {"falls": 0.0, "clearance_mm": 9.0 - seed}


@pytest.fixture
def calls(monkeypatch):
    made = []

    def measure(case, seed):
        made.append(seed)
        return made_up(case, seed)

    monkeypatch.setattr(battery_module, "measure", measure)
    return made


def test_a_battery_goes_on_where_it_stopped(calls, tmp_path):
    path = tmp_path / "store.jsonl"
    Store(path).put(CASE, 1, made_up(CASE, 1))
    with path.open("ab") as file:
        file.write(b'\n{"key": "cut o')  # killed in the middle of a line
    (verdict,) = run_battery([CASE], Store(path), workers=1)
    assert calls == [0, 2]
    assert verdict.figures[1]["clearance_mm"] == 8.0
    run_battery([CASE], Store(path), workers=1)
    assert calls == [0, 2]


def test_other_code_or_other_options_make_old_results_worthless(calls, tmp_path, monkeypatch):
    store = Store(tmp_path / "store.jsonl")
    run_battery([CASE], store, workers=1)
    monkeypatch.setattr(battery_module, "source_hash", lambda: "another")
    assert Store(tmp_path / "store.jsonl").get(CASE, 0) is None
    changed = Case(name="made up", scenario="stand", options={"duration": 2.0})
    assert store.get(changed, 0) is None
    turned = Case(name="made up", scenario="stand", options=CASE.options, directions=4)
    assert store.get(turned, 0) is None


def test_the_worst_seed_decides():
    verdict = Verdict(case=CASE, figures={seed: made_up(CASE, seed) for seed in CASE.seeds})
    assert verdict.value(CASE.limits[1]) == 7.0
    assert not verdict.passed
    kept = Verdict(case=CASE, figures={0: made_up(CASE, 0)})
    assert kept.passed
    unknown = Verdict(case=CASE, figures={0: {"falls": 0.0, "clearance_mm": None}})
    assert not unknown.passed


def test_tables_show_broken_limits():
    verdict = Verdict(case=CASE, figures={seed: made_up(CASE, seed) for seed in CASE.seeds})
    assert "| made up | clearance_mm | ≥ 8 mm | 7 | NO |" in limits_table([verdict])
    assert walking_table([verdict]).endswith("| NO |")
    assert as_plain([verdict])[0]["figures"]["clearance_mm"] == {"median": 8.0, "min": 7.0, "max": 9.0}
    assert battery_line("b", [verdict]) == "- b: 3 runs, 0 falls, clearance_mm at worst 7.00 (limit ≥ 8 mm)"


def test_a_section_is_replaced_between_its_marks():
    text = "a\n<!-- figures:begin (x) -->\nold\n<!-- figures:end -->\nb\n"
    done = replace_between(text, "new", "<!-- figures:begin", "<!-- figures:end")
    assert done == "a\n<!-- figures:begin (x) -->\nnew\n<!-- figures:end -->\nb\n"
    with pytest.raises(ConfigurationError, match="marks"):
        replace_between("nothing here", "new", "<!-- figures:begin", "<!-- figures:end")


COMPARED = ("rough blind", "rough incremental")
"""Batteries that are there to be compared with another one."""


def test_every_battery_asks_for_what_runs_can_do():
    for name in BATTERIES:
        cases = battery(name)
        assert len({case.name for case in cases}) == len(cases)
        for case in cases:
            RunOptions(**case.options)
            assert case.limits or name in COMPARED


def test_an_unknown_battery_lists_the_known_ones():
    with pytest.raises(UnknownNameError, match="walkin.*walking"):
        battery("walkin")
