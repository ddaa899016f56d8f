"""The short version of what model-based control must reach, on two randomised robots."""

import math
import os

import pytest

from bluefoot_mpc.evaluation.battery import Store, Verdict, run_battery
from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.model_cases import (
    REDUCTIONS,
    disturbed_cases,
    slow_walk_cases,
    trot_cases,
)

pytestmark = pytest.mark.slow

SEEDS = (3, 11)
DURATION = 15.0
ALONE = ("trot 60 mm/s", "trot 300 mm/s")
COMPARED = ("walk 30 mm/s", "slope +8°")


def cases(controller: str, names: tuple[str, ...]) -> list[Case]:
    """Cases of the batteries by name, for a shorter time."""
    found = {
        case.name: case
        for make in (trot_cases, slow_walk_cases, disturbed_cases)
        for case in make(controller, SEEDS)
    }
    return [
        Case(
            name=f"{name} {controller}",
            scenario=found[name].scenario,
            options={**found[name].options, "duration": DURATION},
            seeds=SEEDS,
            limits=found[name].limits,
        )
        for name in names
    ]


PLANNED = cases("mpc", (*ALONE, *COMPARED))
RUNS = [*PLANNED, *cases("cpg", COMPARED)]


@pytest.fixture(scope="module")
def verdicts() -> dict[str, Verdict]:
    workers = 1 if "PYTEST_XDIST_WORKER" in os.environ else None
    return {verdict.case.name: verdict for verdict in run_battery(RUNS, Store(None), workers=workers)}


@pytest.mark.parametrize("name", [case.name for case in PLANNED])
@pytest.mark.timeout(500)
def test_every_limit_is_kept(verdicts, name):
    verdict = verdicts[name]
    broken = {
        limit.figure: verdict.values(limit.figure)
        for limit in verdict.case.limits
        if not verdict.holds(limit)
    }
    assert not broken


@pytest.mark.parametrize("name", [case.name for case in PLANNED])
def test_every_problem_is_solved(verdicts, name):
    assert verdicts[name].values("qp_failures") == [0, 0]


@pytest.mark.parametrize("name", COMPARED)
def test_the_trunk_tilts_less_than_by_the_papers_laws(verdicts, name):
    planned, paper = (verdicts[f"{name} {which}"].values("tilt_rms_deg") for which in ("mpc", "cpg"))
    for with_plan, without in zip(planned, paper, strict=True):
        assert math.isfinite(without)
        assert with_plan <= (1.0 - REDUCTIONS[name]) * without
