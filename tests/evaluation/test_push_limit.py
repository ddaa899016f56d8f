import pytest

from bluefoot_mpc.evaluation import battery as battery_module
from bluefoot_mpc.evaluation.battery import Store
from bluefoot_mpc.evaluation.push_limit import PushSearch, as_plain, push_limits
from bluefoot_mpc.exceptions import ConfigurationError


def test_the_limit_of_every_direction_and_seed_is_found(monkeypatch):
    runs = []

    def measure(case, seed):
        runs.append(seed)
        limit = 2.0 + case.options["direction"] / 90.0 + 0.5 * seed
        return {"falls": float(case.options["impulse"] > limit)}

    monkeypatch.setattr(battery_module, "measure", measure)
    search = PushSearch(directions=4, seeds=2, halvings=6)
    found = push_limits("cpg", search, Store(None), workers=1)
    assert len(runs) == search.runs == 48
    for k, limit in enumerate(found):
        assert limit.direction == 90.0 * k
        for seed, survived in enumerate(limit.survived):
            truth = 2.0 + k + 0.5 * seed
            assert truth - search.resolution <= survived <= truth
        assert limit.least == min(limit.survived)
    assert as_plain(found)[1]["survived_ns"] == list(found[1].survived)


def test_what_was_never_survived_stays_at_the_least(monkeypatch):
    monkeypatch.setattr(battery_module, "measure", lambda case, seed: {"falls": None})
    (only,) = push_limits("cpg", PushSearch(directions=1, seeds=1), Store(None), workers=1)
    assert only.median == 0.5


@pytest.mark.parametrize("wrong", [{"least": 9.0}, {"halvings": 0}, {"directions": 0}])
def test_an_impossible_search_is_refused(wrong):
    with pytest.raises(ConfigurationError):
        PushSearch(**wrong)
