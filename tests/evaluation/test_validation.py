"""Running a validation: what is run, what is kept, what a stop leaves."""

import multiprocessing
import time

import pytest

from bluefoot_mpc.evaluation import validation as module
from bluefoot_mpc.evaluation.battery import Store
from bluefoot_mpc.evaluation.validation import Job, missing_runs, validate
from bluefoot_mpc.evaluation.validation_cases import SITUATIONS, validation_cases
from bluefoot_mpc.evaluation.validation_plan import Plan
from bluefoot_mpc.evaluation.validation_record import load_record
from bluefoot_mpc.evaluation.validation_subject import subject_of
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.scenarios import RunOptions
from tests.evaluation.validated import CODE, kept


@pytest.fixture
def calls(monkeypatch):
    """Runs that were made; the one that is named in `calls.stop` is interrupted."""

    class Calls(list):
        stop = None

    made = Calls()

    def measure(case, seed):
        if (case.name, seed) == made.stop:
            raise KeyboardInterrupt
        made.append((case.name, seed))
        return kept(case, seed)

    monkeypatch.setattr(module, "measure_validation", measure)
    monkeypatch.setattr(module, "code_now", lambda: CODE)
    return made


def job(folder, **plan):
    return Job(
        subject=subject_of(RunOptions()), plan=Plan(**plan), out=folder / "out",
        records=folder / "records", workers=1,
    )  # fmt: skip


def run(folder, **plan):
    wanted = job(folder, **plan)
    cases = wanted.cases()
    return validate(wanted, cases, Store(wanted.out / module.RUNS))


def test_every_situation_is_tried_on_both_robots_with_every_seed(calls, tmp_path):
    record = load_record(run(tmp_path).file)
    assert record.passed
    names = {f"{situation.name}, {robot}" for situation in SITUATIONS for robot in ("sim", "emulator")}
    assert len(names) == 10
    assert sorted(calls) == sorted((name, seed) for name in names for seed in range(3))
    assert all("config" not in case["options"] for case in record.table["cases"])


def test_a_validation_goes_on_where_it_was_stopped(calls, tmp_path):
    calls.stop = ("walk, emulator", 1)
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path)
    assert not (tmp_path / "records").exists()
    done = list(calls)
    assert len(done) == 10
    calls.stop = None
    assert run(tmp_path).passed
    assert len(calls) == 30
    assert len(set(calls)) == 30
    run(tmp_path)
    assert len(calls) == 30


def test_another_configuration_or_speed_is_run_anew(calls, tmp_path):
    run(tmp_path, quick=True)
    run(tmp_path, quick=True, speed=0.1)
    assert len(calls) == 10 + 8  # standing knows no speed
    other = Job(
        subject=subject_of(RunOptions(overrides=("safety.voltage_sit=10.0",))), plan=Plan(quick=True),
        out=tmp_path / "out", records=tmp_path / "records", workers=1,
    )  # fmt: skip
    assert len(missing_runs(other.cases(), Store(other.out / module.RUNS))) == 10


def test_code_that_changes_meanwhile_leaves_no_record(calls, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "code_now", iter([CODE, CODE, None]).__next__)
    with pytest.raises(ConfigurationError, match="code was changed"):
        run(tmp_path, quick=True)
    assert not (tmp_path / "records").exists()


def test_a_folder_that_cannot_be_made_is_told(tmp_path):
    (tmp_path / "out").write_text("a file")
    with pytest.raises(ConfigurationError, match="--out"):
        job(tmp_path).cases()


def test_cases_say_how_the_configuration_is_tried(tmp_path):
    full = {case.name: case for case in validation_cases(Plan(speed=0.1, gait="walk"), tmp_path / "c.toml")}
    quick = {case.name: case for case in validation_cases(Plan(quick=True), tmp_path / "c.toml")}
    for name, case in full.items():
        assert case.options["randomize"] == "standard"
        assert case.options["robot"] == name.split(", ")[1]
        assert ("speed" in case.options) == (not name.startswith("stand"))
        assert len(case.seeds) == 3
        assert quick[name].seeds == (0,)
        assert quick[name].options["duration"] <= case.options["duration"]
    assert full["walk, sim"].options["gait"] == "walk"
    on_devices = {limit.figure for limit in full["push, emulator"].limits}
    assert on_devices >= {"falls", "protocol_violations", "eeprom_writes", "torque_left"}


@pytest.mark.parametrize("plan", [{"speed": 0.0}, {"speed": 0.6}, {"seeds": 0}, {"gait": "gallop"}])
def test_impossible_plans_are_refused(plan):
    with pytest.raises(ConfigurationError):
        Plan(**plan)


def test_only_a_full_plan_allows_a_deployment():
    assert Plan().is_full
    assert not Plan(seeds=2).is_full
    assert not Plan(quick=True, seeds=20).is_full


@pytest.mark.slow
def test_processes_side_by_side_are_gone_when_nobody_wants_them(tmp_path):
    subject = subject_of(RunOptions(controller="cpg"))
    wanted = Job(subject=subject, plan=Plan(quick=True), out=tmp_path, records=tmp_path, workers=2)
    case = wanted.cases()[0]
    before = set(multiprocessing.active_children())
    runs = module._runs([(case, seed) for seed in range(6)], workers=2)
    _, seed, figures = next(runs)
    assert figures == module.measure_validation(case, seed)
    runs.close()
    # A process that was told to go takes a moment on a busy machine.
    end = time.monotonic() + 20.0
    while set(multiprocessing.active_children()) != before and time.monotonic() < end:
        time.sleep(0.05)
    assert set(multiprocessing.active_children()) == before
