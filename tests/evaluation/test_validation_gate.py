"""The gate: one record opens it, and everything else is told why not."""

import dataclasses

import orjson
import pytest

from bluefoot_mpc.evaluation.validation_gate import Demand, demand_of, differences, judge
from bluefoot_mpc.evaluation.validation_plan import Plan
from bluefoot_mpc.evaluation.validation_record import own_hash
from bluefoot_mpc.evaluation.validation_subject import subject_of
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.findings import Severity
from bluefoot_mpc.scenarios import RunOptions, find_scenario
from tests.evaluation.validated import CODE, made_up

SUBJECT = subject_of(RunOptions())
MEND = "bluefoot validate own.toml"


def look(folder, subject=SUBJECT, code=CODE, demand=None):
    return judge(folder, subject, code, demand or Demand(), MEND)


def refusal(verdict):
    """The one refusal of a verdict."""
    assert not verdict.allows
    (finding,) = [f for f in verdict.findings if f.severity is Severity.REFUSAL]
    assert MEND in finding.mend
    return f"{finding.text} | {finding.mend}"


def test_a_record_that_passed_opens_the_gate(tmp_path):
    record = made_up(tmp_path)
    verdict = look(tmp_path, demand=Demand(speed=0.06, gaits=frozenset(["trot"])))
    assert verdict.allows
    assert verdict.findings == ()
    assert verdict.record.file == record.file


def test_what_was_never_validated_is_refused(tmp_path):
    assert "never validated" in refusal(look(tmp_path))
    assert "never validated" in refusal(look(tmp_path / "no folder"))


def test_a_changed_configuration_names_the_keys(tmp_path):
    made_up(tmp_path, options=RunOptions(overrides=("safety.voltage_sit=10.0", "devices.period=0.025")))
    text = refusal(look(tmp_path))
    assert "safety.voltage_sit: 10.0 -> 10.2" in text
    assert "devices.period: 0.025 -> 0.02" in text
    assert "2026-01-31" in text


def test_changed_code_names_files_and_versions(tmp_path):
    made_up(tmp_path)
    code = dataclasses.replace(
        CODE, source="def", files={"a.py": "1" * 12, "b.py": "3" * 12}, versions={"numpy": "2.1"}
    )
    text = refusal(look(tmp_path, code=code))
    assert "b.py" in text
    assert "a.py" not in text
    assert "versions.numpy: 2.0 -> 2.1" in text


def test_a_failed_record_names_the_broken_limits(tmp_path):
    made_up(tmp_path, torque_left=3.0)
    text = refusal(look(tmp_path))
    assert "failed on" in text
    assert "torque_left ≤ 0" in text


@pytest.mark.parametrize(("plan", "why"), [(Plan(quick=True), "quick"), (Plan(seeds=2), r"2 seed")])
def test_too_little_is_refused(tmp_path, plan, why):
    made_up(tmp_path, plan=plan)
    assert why in refusal(look(tmp_path))


def test_faster_or_another_gait_than_validated_is_refused(tmp_path):
    made_up(tmp_path)
    text = refusal(look(tmp_path, demand=Demand(speed=0.1, gaits=frozenset(["trot"]))))
    assert "60 mm/s" in text
    assert "--scenario-speed 0.1" in text
    assert "--gait walk" in refusal(look(tmp_path, demand=Demand(speed=0.03, gaits=frozenset(["walk"]))))


def test_what_the_battery_does_not_try_is_a_warning(tmp_path):
    made_up(tmp_path)
    verdict = look(tmp_path, demand=Demand(turns=True, poses=True))
    assert verdict.allows
    assert [f.severity for f in verdict.findings] == [Severity.WARNING] * 2


def test_a_damaged_record_is_refused_and_a_sound_one_beside_it_counts(tmp_path):
    record = made_up(tmp_path)
    record.file.write_bytes(record.file.read_bytes().replace(b'"speed": 0.06', b'"speed": 0.46'))
    assert "own hash" in refusal(look(tmp_path))
    made_up(tmp_path, plan=Plan(seeds=4))
    assert look(tmp_path).allows


def test_a_record_under_another_name_is_of_what_it_says(tmp_path):
    record = made_up(tmp_path, options=RunOptions(overrides=("safety.voltage_sit=10.0",)))
    record.file.rename(tmp_path / f"{SUBJECT.sha256[:16]}-00000000.json")
    assert "voltage_sit" in refusal(look(tmp_path))


def test_an_older_success_outlives_a_quick_one(tmp_path):
    made_up(tmp_path)
    made_up(tmp_path, plan=Plan(quick=True), made="2026-02-01T12:00:00+00:00")
    assert look(tmp_path).allows


def test_demands_are_what_scenarios_command():
    def demand(name, **options):
        scenario = find_scenario(name)
        return demand_of(scenario(scenario.Config(**options)))

    assert demand("stand") == Demand()
    assert demand("walk", speed=0.1, gait="walk") == Demand(speed=0.1, gaits=frozenset(["walk"]))
    assert demand("turn").turns
    assert demand("pose").poses
    assert demand("transition").gaits == {"trot", "walk"}


def test_a_scenario_that_fails_is_told():
    class Broken(find_scenario("stand")):
        def command(self, time):
            return time

    with pytest.raises(ConfigurationError, match=r"fails at 0\.00 s: AttributeError"):
        demand_of(Broken())


@pytest.mark.parametrize("code", [{}, {"files": {}}, {"source": 3, "versions": 4}])
def test_code_that_is_not_told_is_other_code(tmp_path, code):
    record = made_up(tmp_path)
    table = {**record.table, "code": code}
    record.file.write_bytes(orjson.dumps({**table, "sha256": own_hash(table)}))
    assert "the code is not the one" in refusal(look(tmp_path))


def test_differences_name_new_and_missing_keys():
    old = {"a": {"b": 1, "c": [1, 2]}, "d": "x"}
    new = {"a": {"b": 2, "c": [1, 2], "e": True}}
    assert list(differences(old, new)) == ["a.b: 1 -> 2", "a.e: (none) -> True", "d: x -> (none)"]
