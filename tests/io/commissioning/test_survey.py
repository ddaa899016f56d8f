"""Scanning: who answers, who does not, and nothing is written."""

import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.commissioning.checks import check_ids, require_sound, silence
from bluefoot_mpc.io.commissioning.ports import split_ports
from bluefoot_mpc.io.commissioning.survey import find_bauds, parse_ids, survey, survey_findings
from bluefoot_mpc.io.findings import NotArmedError, Severity

from .bench import BAUD, ID, RETURN_DELAY, STATUS_LEVEL, Bench

ALL = tuple(range(1, 17))


def refusals(findings):
    return [str(f) for f in findings if f.severity is Severity.REFUSAL]


def test_ids_are_numbers_and_ranges():
    assert parse_ids("1-16") == ALL
    assert parse_ids("7, 3,1-2") == (1, 2, 3, 7)
    for wrong in ("", "a", "3-1", "1-", "254", "-3", "1,,2"):
        with pytest.raises(ConfigurationError, match="--ids"):
            parse_ids(wrong)


def test_ports_are_split_at_commas_and_named_once():
    assert split_ports(["/dev/a,/dev/b", "/dev/c"]) == ("/dev/a", "/dev/b", "/dev/c")
    with pytest.raises(ConfigurationError, match="--port is missing"):
        split_ports([])
    with pytest.raises(ConfigurationError, match="/dev/a is given twice"):
        split_ports(["/dev/a", "/dev/a"])


def test_a_scan_finds_all_and_only_reads():
    bench = Bench(commissioned=False)
    found = survey(bench.ports(), ALL)
    assert tuple(found.servos) == ALL
    assert not survey_findings(found)
    facts = found.servos[7]
    assert (facts["model_number"], facts.joint, facts["return_delay_time"]) == (12, "FR_knee", 250)
    assert facts.voltage == pytest.approx(12.0, abs=0.1)
    assert facts.limits == (0, 1023)
    assert bench.line.eeprom_writes == 0
    assert set(bench.line.requests) == {1, 2}  # ping and read
    assert bench.line.violations == 0


def test_a_missing_servo_is_named_with_its_mend():
    bench = Bench()
    bench.line.plug(bench.line.servos[5], False, 0.0)
    found = survey(bench.ports(), ALL)
    assert found.missing == (5,)
    (text,) = refusals(survey_findings(found))
    assert "servo 5 (FR_hip_yaw): no reply" in text
    assert "cable" in text


def test_two_servos_with_one_id_are_told_from_one():
    bench = Bench()
    bench.line.servos[9].write(ID, 4)
    bench.turn(8, 20.0)
    found = survey(bench.ports(), ALL)
    assert list(found.garbled) == [4]
    assert found.missing == (9,)
    assert any("two servos share this ID" in text for text in refusals(survey_findings(found)))


def test_another_model_is_refused():
    bench = Bench()
    bench.line.servos[2].write(0, 18, 2)
    (text,) = refusals(survey_findings(survey(bench.ports(), ALL)))
    assert "servo 2 (FL_hip_pitch): model 18 instead of 12" in text


def test_a_servo_that_answers_pings_alone_is_named():
    bench = Bench()
    bench.line.servos[2].write(STATUS_LEVEL, 0)
    found = survey(bench.ports(), (1, 2))
    assert "status return level" in found.garbled[2]


def test_the_right_baud_rate_is_found_and_named():
    bench = Bench(count=16, baud=57_600)
    ports = bench.ports(1_000_000)
    found = survey(ports, ALL)
    assert found.missing == ALL
    assert find_bauds(ports, ALL) == {57_600: ALL}
    (finding,) = silence(ports, ALL, found)
    assert "16 of 16 answer at 57600" in finding.text
    assert "--baud 57600" in finding.mend
    assert ports.baud == ports.buses[0].link.baud == 1_000_000


def test_a_dead_bus_is_told_from_a_wrong_rate():
    bench = Bench()
    bench.line.power(False, 0.0)
    ports = bench.ports()
    (finding,) = silence(ports, ALL, survey(ports, ALL))
    assert "no standard baud rate" in finding.text
    assert "power" in finding.mend


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (
            lambda bench: setattr(bench.line.servos[3], "forced_temperature", 66.0),
            ["servo 3 (FL_knee)", "66 °C"],
        ),
        (lambda bench: bench.shafts.set_supply(9.8), ["below 10.2 V", "Charge"]),
        (lambda bench: bench.line.servos[6].write(RETURN_DELAY, 250), ["servo 6", "bluefoot servo setup"]),
        (lambda bench: bench.line.plug(bench.line.servos[8], False, 0.0), ["servo 8 (FR_ankle)", "no reply"]),
        (lambda bench: bench.line.servos[9].write(BAUD, 34), ["servo 9", "no reply"]),
    ],
)
def test_what_must_not_get_torque_is_refused(spoil, words):
    bench = Bench()
    spoil(bench)
    bench.clock.sleep_until(1.0)
    with pytest.raises(NotArmedError) as caught:
        require_sound(bench.ports(), ALL)
    for word in words:
        assert word in str(caught.value)
    assert bench.limp
    assert set(bench.line.requests) <= {1, 2}


def test_sound_servos_may_get_torque():
    bench = Bench()
    assert tuple(require_sound(bench.ports(), (1, 5)).servos) == (1, 5)


def test_an_id_without_a_joint_is_refused():
    with pytest.raises(ConfigurationError, match="20 belongs to no joint"):
        check_ids(Bench().ports(), (1, 20))
