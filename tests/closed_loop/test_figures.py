"""The short version of the figures that ``make figures`` measures in full."""

import os

import pytest

from bluefoot_mpc.evaluation.battery import Store, Verdict, run_battery
from bluefoot_mpc.evaluation.law_cases import (
    estimation_cases,
    other_robot_cases,
    push_cases,
    robustness_cases,
    transition_cases,
    walking_cases,
)
from bluefoot_mpc.types import LEGS

pytestmark = pytest.mark.slow

SEEDS = (0, 1)
CASES = {
    case.name: case
    for case in (
        *walking_cases(SEEDS, 20.0),
        *estimation_cases(SEEDS, 20.0),
        *push_cases((2,)),
        *transition_cases((3,)),
        *other_robot_cases((0,)),
        *robustness_cases((0,)),
    )
}


@pytest.fixture(scope="module")
def verdicts() -> dict[str, Verdict]:
    workers = 1 if "PYTEST_XDIST_WORKER" in os.environ else None
    return {
        verdict.case.name: verdict
        for verdict in run_battery(list(CASES.values()), Store(None), workers=workers)
    }


@pytest.mark.parametrize("name", CASES)
@pytest.mark.timeout(500)
def test_every_limit_is_kept(verdicts, name):
    verdict = verdicts[name]
    broken = {limit.figure: verdict.value(limit) for limit in verdict.case.limits if not verdict.holds(limit)}
    assert not broken


def lags_of(verdicts, gait):
    """Lift-off lags of every run of a gait: leg to fraction of the cycle."""
    for verdict in verdicts.values():
        if verdict.case.options.get("gait") == gait:
            for figures in verdict.figures.values():
                yield {leg: figures[f"lag_{leg}"] for leg in LEGS}


def test_a_trot_lifts_its_diagonals_together(verdicts):
    wanted = dict(zip(LEGS, (0.0, 0.5, 0.5, 0.0), strict=True))
    runs = list(lags_of(verdicts, "trot"))
    assert runs
    for lags in runs:
        for leg in LEGS:
            assert abs((lags[leg] - wanted[leg] + 0.5) % 1.0 - 0.5) <= 0.03, (leg, lags)


def test_a_walk_is_a_lateral_sequence(verdicts):
    runs = list(lags_of(verdicts, "walk"))
    assert runs
    for lags in runs:
        order = sorted(LEGS, key=lambda leg: (lags[leg] - lags["FR"]) % 1.0)
        assert order == ["FR", "RL", "FL", "RR"], lags
