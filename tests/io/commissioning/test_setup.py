"""Setting up: what is planned is what is written, once, and read back."""

import pytest

from bluefoot_mpc.exceptions import ConfigurationError, DeviceError
from bluefoot_mpc.io.commissioning.checks import check_ids
from bluefoot_mpc.io.commissioning.setup import (
    SetupConfig,
    apply,
    change_baud,
    change_id,
    check_baud,
    plan,
)
from bluefoot_mpc.io.commissioning.survey import survey
from bluefoot_mpc.io.dynamixel.errors import EepromRefusedError, NoReplyError
from bluefoot_mpc.io.findings import Severity

from .bench import BAUD, CCW_LIMIT, CW_LIMIT, ID, LOCK, RETURN_DELAY, SHUTDOWN, TORQUE, Bench

ALL = tuple(range(1, 17))


def test_factory_servos_need_their_return_delay_and_nothing_else():
    bench = Bench(commissioned=False)
    changes = plan(survey(bench.ports(), ALL), SetupConfig())
    assert [(c.servo, c.register, c.old, c.new) for c in changes] == [
        (servo, "return_delay_time", 250, 0) for servo in ALL
    ]
    assert bench.line.eeprom_writes == 0


def test_what_is_written_makes_servos_sound_and_is_written_once():
    bench = Bench(commissioned=False)
    bench.line.servos[3].write(CW_LIMIT, 0, 2)
    bench.line.servos[3].write(CCW_LIMIT, 0, 2)
    bench.line.servos[4].write(SHUTDOWN, 37)
    bench.line.servos[5].write(TORQUE, 1)
    ports = bench.ports(allow_eeprom=True)
    changes = plan(survey(ports, ALL), SetupConfig())
    assert len(changes) == 18
    apply(ports, changes)
    assert bench.line.eeprom_writes == 18
    assert bench.line.servos[3].read(CCW_LIMIT, 2) == 1023
    assert bench.line.servos[4].read(SHUTDOWN) == 36
    assert bench.line.servos[5].read(TORQUE) == 0
    assert not plan(survey(ports, ALL), SetupConfig())
    assert not [f for f in check_ids(ports, ALL) if f.severity is Severity.REFUSAL]


def test_no_other_command_can_write_permanent_memory():
    bench = Bench(commissioned=False)
    ports = bench.ports()
    with pytest.raises(EepromRefusedError):
        apply(ports, plan(survey(ports, ALL), SetupConfig()))
    assert bench.line.eeprom_writes == 0


def test_a_missing_servo_stops_everything():
    bench = Bench(commissioned=False)
    bench.line.plug(bench.line.servos[5], False, 0.0)
    with pytest.raises(DeviceError, match=r"nothing was written:\n.*servo 5"):
        plan(survey(bench.ports(allow_eeprom=True), ALL), SetupConfig())


def test_a_locked_servo_says_how_to_unlock_it():
    bench = Bench(commissioned=False)
    bench.line.servos[2].write(LOCK, 1)
    with pytest.raises(DeviceError, match="servo 2 .*power off and on"):
        plan(survey(bench.ports(allow_eeprom=True), ALL), SetupConfig())


def test_an_id_is_changed_and_found_again():
    bench = Bench()
    facts = change_id(bench.ports(allow_eeprom=True), 16, 40)
    assert facts.id == facts["id"] == 40
    assert bench.line.all[15].read(ID) == 40
    assert bench.line.eeprom_writes == 1


@pytest.mark.parametrize(("old", "new", "words"), [(3, 4, "ID 4 is taken"), (3, 300, "--new-id = 300")])
def test_an_impossible_new_id_writes_nothing(old, new, words):
    bench = Bench()
    with pytest.raises((DeviceError, ConfigurationError), match=words):
        change_id(bench.ports(allow_eeprom=True), old, new)
    assert bench.line.eeprom_writes == 0


def test_two_servos_at_the_old_id_write_nothing():
    bench = Bench()
    bench.line.servos[9].write(ID, 4)
    bench.turn(8, 20.0)
    with pytest.raises(DeviceError, match="more than one servo"):
        change_id(bench.ports(allow_eeprom=True), 4, 20)
    assert bench.line.eeprom_writes == 0


def test_nobody_at_the_old_id():
    with pytest.raises(NoReplyError, match="servo 20"):
        change_id(Bench().ports(allow_eeprom=True), 20, 21)


def test_the_baud_rate_is_changed_on_both_sides():
    bench = Bench()
    ports = bench.ports(allow_eeprom=True)
    change_baud(ports, ALL, 500_000)
    assert {servo.read(BAUD) for servo in bench.line.all} == {3}
    assert tuple(survey(ports, ALL).servos) == ALL
    with pytest.raises(ConfigurationError, match="no rate of an AX-12A"):
        check_baud(3_000_000)


def test_return_delay_in_microseconds():
    bench = Bench()
    ports = bench.ports(allow_eeprom=True)
    apply(ports, plan(survey(ports, (1,)), SetupConfig(return_delay_us=100.0)))
    assert bench.line.servos[1].read(RETURN_DELAY) == 50
    with pytest.raises(ConfigurationError, match="return_delay_us"):
        SetupConfig(return_delay_us=1000.0)
