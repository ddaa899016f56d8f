import optuna
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.tuning.cases import TuningCase, walking_case
from bluefoot_mpc.tuning.objective import Bars, Figures
from bluefoot_mpc.tuning.space import Parameter, Space
from bluefoot_mpc.tuning.study import StudyConfig, run_study

SPACE = Space(
    parameters=(
        Parameter(name="a", keys=("x.a",), low=0.0, high=1.0),
        Parameter(name="b", keys=("x.b",), low=-1.0, high=1.0),
    )
)
CASE = TuningCase(name="made up", scenario="walk", options={}, bars=Bars(roll=1, pitch=1, worst=1), start=1.0)
SEEDS = (100, 101, 102, 103)


@pytest.fixture(autouse=True)
def _quiet():
    level = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    yield
    optuna.logging.set_verbosity(level)


class Bowl:
    """A simulator whose tilt is smallest at a = 0.3, b = 0.5."""

    def __init__(self):
        self.calls = []

    def __call__(self, case, controller, overrides, seed):
        self.calls.append((case.name, controller, overrides, seed))
        a, b = (float(text.partition("=")[2]) for text in overrides)
        tilt = 0.1 + (a - 0.3) ** 2 + (b - 0.5) ** 2 + 1e-3 * (seed % 10)
        return Figures(
            fell=False, roll=tilt, pitch=tilt, clearance=20.0, speed_error=0.0, drift=0.0, cuts=0.0
        )


def config(**changes):
    return StudyConfig(**{"name": "t", "trials": 40, "seeds": SEEDS, "rungs": (2, 4), **changes})


def test_search_comes_near_the_optimum():
    result = run_study(config(), SPACE, [CASE], evaluate=Bowl())
    assert result.values["a"] == pytest.approx(0.3, abs=0.2)
    assert result.values["b"] == pytest.approx(0.5, abs=0.2)
    assert result.trials == 40
    assert set(result.figures["made up"]) == {str(seed) for seed in SEEDS}


def test_given_points_come_first_and_inside_their_ranges():
    bowl = Bowl()
    result = run_study(config(trials=2), SPACE, [CASE], [{"a": 0.3, "b": 0.5}, {"a": 5.0, "b": 0}], bowl)
    seen = list(dict.fromkeys(overrides for _, _, overrides, _ in bowl.calls))
    assert seen == [("x.a=0.3", "x.b=0.5"), ("x.a=1.0", "x.b=0.0")]
    assert result.values == {"a": 0.3, "b": 0.5}


def test_poor_points_are_given_up_after_the_first_rung():
    bowl = Bowl()
    run_study(config(startup=5), SPACE, [CASE], evaluate=bowl)
    seeds_used = {}
    for _, _, overrides, seed in bowl.calls:
        seeds_used.setdefault(overrides, []).append(seed)
    counts = [len(seeds) for seeds in seeds_used.values()]
    assert set(counts) == {2, 4}
    assert counts.count(2) > len(counts) / 3
    assert all(seeds == list(SEEDS[: len(seeds)]) for seeds in seeds_used.values())


def test_a_study_on_a_file_goes_on_within_its_budget(tmp_path):
    bowl, file = Bowl(), tmp_path / "new" / "study.db"
    first = run_study(config(storage=file, trials=6), SPACE, [CASE], evaluate=bowl)
    spent = len(bowl.calls)
    again = run_study(config(storage=file, trials=6), SPACE, [CASE], evaluate=bowl)
    assert len(bowl.calls) == spent
    assert again == first
    more = run_study(config(storage=file, trials=9), SPACE, [CASE], evaluate=bowl)
    assert more.trials == 9
    assert more.cost <= first.cost


def test_controller_and_every_case_reach_the_simulator():
    bowl = Bowl()
    other = TuningCase(name="other", scenario="push", options={}, bars=CASE.bars, start=1.0, weight=3.0)
    result = run_study(config(controller="mpc", trials=2), SPACE, [CASE, other], evaluate=bowl)
    assert {controller for _, controller, _, _ in bowl.calls} == {"mpc"}
    assert set(result.figures) == {"made up", "other"}


def test_another_judge_may_make_the_cost():
    def judge(cases, seen):
        assert [case.name for case in cases] == list(seen) == ["made up"]
        return 7.0 - seen["made up"][0].roll

    result = run_study(config(), SPACE, [CASE], evaluate=Bowl(), judge=judge)
    # The steepest tilt now is the best: the corner that is farthest from the bowl's bottom.
    assert result.cost < 7.0 - 2.0
    assert result.values["b"] < -0.5


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seeds": (5, 100, 101, 102)}, "must be 100 or more"),
        ({"rungs": (2, 3)}, "end at the number of seeds"),
        ({"rungs": (4, 2, 4)}, "must rise"),
        ({"trials": 0}, "trials"),
        ({"keep": 0.0}, "keep"),
    ],
)
def test_impossible_studies_are_refused(changes, message):
    with pytest.raises(ConfigurationError, match=message):
        config(**changes)


def test_a_study_needs_a_case():
    with pytest.raises(ConfigurationError, match="at least one case"):
        run_study(config(), SPACE, [])


def test_a_walking_case_is_measured_after_its_ramp():
    case = walking_case("trot", 0.4)
    assert case.start >= 1.5 + 0.4 / 0.1
    assert case.options["duration"] > case.start
    assert case.options["randomize"] == "standard"
    with pytest.raises(ConfigurationError, match="bars up to"):
        walking_case("trot", 0.9)
