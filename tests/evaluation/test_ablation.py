import pytest

from bluefoot_mpc.evaluation import ablation
from bluefoot_mpc.evaluation import battery as battery_module
from bluefoot_mpc.evaluation.battery import Store
from bluefoot_mpc.evaluation.variants import VARIANTS, variants
from bluefoot_mpc.exceptions import UnknownNameError
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.registry import find_scenario


@pytest.fixture
def ran(monkeypatch):
    """Runs that were asked for, answered by made-up figures: mpc tilts half as much as cpg."""
    seen = []

    def measure(case, seed):
        seen.append((case, seed))
        tilt = (1.0 + 0.1 * seed) * (0.5 if case.options["controller"] == "mpc" else 1.0)
        return {"falls": 0.0, "roll_rms_deg": tilt, "pitch_rms_deg": tilt, "tilt_rms_deg": 1.41 * tilt}

    monkeypatch.setattr(battery_module, "measure", measure)
    return seen


def test_every_variant_meets_the_same_seeds_and_is_compared_with_the_first(ran):
    cases = ablation.chosen(["payload", "walk-30"], seeds=4, duration=7.0)
    rows = ablation.ablate(cases, VARIANTS, Store(None), workers=1)
    assert len(ran) == 2 * len(VARIANTS) * 4
    assert {seed for _, seed in ran} == {0, 1, 2, 3}
    assert {case.options["duration"] for case, _ in ran} == {7.0}
    assert [row.variant.name for row in rows[: len(VARIANTS)]] == [v.name for v in VARIANTS]
    assert rows[0].comparisons == {}
    ratio = rows[1].comparisons["tilt_rms_deg"].ratio
    assert (ratio.low, ratio.value, ratio.high) == pytest.approx((0.5, 0.5, 0.5))
    plain = rows[1].as_plain()
    assert plain["against_first"]["tilt_rms_deg"]["pairs"] == 4
    assert plain["figures"]["roll_rms_deg"] == {"median": 0.575, "min": 0.5, "max": 0.65}


def test_a_reduction_that_is_asked_for_is_judged(ran):
    cases = ablation.chosen(["payload"], seeds=4, duration=None)
    rows = ablation.ablate(cases, VARIANTS, Store(None), workers=1)
    judged = {(row["figure"], row["limit"]): row["holds"] for row in ablation.criteria(rows, "mpc")}
    assert judged[("tilt_rms_deg", "≤ 0.7 of the paper's laws")]
    assert judged[("falls", "≤ 0 in ≥ 95 % of the runs")]
    assert ablation.criteria(rows, "nobody") == []


def test_own_overrides_of_a_case_stay(ran):
    cases = ablation.chosen(["friction"], seeds=1, duration=None)
    ablation.ablate(cases, VARIANTS, Store(None), workers=1)
    for (case, _), variant in zip(ran, VARIANTS, strict=True):
        assert case.options["overrides"][0].startswith("sim.randomization.friction")
        assert case.options["overrides"][1:] == variant.overrides


def test_what_is_known_is_not_run_again(ran):
    store = Store(None)
    cases = ablation.chosen(["payload"], seeds=2, duration=None)
    assert ablation.missing_runs(cases, VARIANTS, store) == 2 * len(VARIANTS)
    ablation.ablate(cases, VARIANTS, store, workers=1)
    assert ablation.missing_runs(cases, VARIANTS, store) == 0


def test_a_push_keeps_its_time_and_comes_from_every_side():
    (case,) = ablation.chosen(["push-2"], seeds=2, duration=7.0).values()
    assert case.options["duration"] == 10.0
    assert len(case.seeds) == 24


def test_names_that_do_not_exist_list_those_that_do():
    with pytest.raises(UnknownNameError, match="walk-30"):
        ablation.chosen(["walk-31"], seeds=1, duration=None)
    with pytest.raises(UnknownNameError, match="cpg"):
        variants(("cpq",))


@pytest.mark.parametrize("variant", VARIANTS, ids=lambda v: v.name)
def test_every_variant_is_a_configuration_that_exists(variant):
    options = RunOptions(controller=variant.controller, overrides=variant.overrides)
    assert resolve(find_scenario("walk"), options).run.controller == variant.controller


def test_every_reduction_names_a_case():
    names = {case.name for case in ablation.bench_cases().values()}
    assert set(ablation.model_cases.REDUCTIONS) <= names
