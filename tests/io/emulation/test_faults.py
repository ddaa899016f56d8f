import math
import re
from pathlib import Path

import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.clock import VirtualClock
from bluefoot_mpc.io.emulation.faults import KINDS, Fault, FaultPlan
from bluefoot_mpc.io.emulation.faults_line import FaultyLine
from bluefoot_mpc.io.emulation.memory_link import MemoryLink
from bluefoot_mpc.io.emulation.own_shafts import OwnShafts
from bluefoot_mpc.io.emulation.servo_line import ServoLine
from bluefoot_mpc.io.link import LinkLostError
from tests.io.emulation.bench import ALL, PING, READ, SYNC_WRITE, WRITE, low_high, packet, status
from tests.io.emulation.test_memory_link import Parrot

POSITION = (READ, 36, 2)
VOLTAGE, HEAT, RANGE, OVERLOAD = 1, 4, 8, 32


class Case:
    """Three servos without return delay, and what is to go wrong with them."""

    def __init__(self, *faults, seed=0, start=0.0):
        self.shafts = OwnShafts(3)
        self.line = ServoLine(self.shafts, (1, 2, 3))
        for servo in self.line.all:
            servo.write(5, 0)
        self.clock = VirtualClock(start)
        self.faulty = FaultyLine(self.line, FaultPlan(faults=faults, seed=seed), start)
        self.link = MemoryLink(self.faulty, self.clock)

    def ask(self, identity, *words, wait=0.01):
        """A request, and everything that arrives within `wait` seconds."""
        self.link.write(packet(identity, *words))
        return self.listen(wait)

    def listen(self, wait=0.01):
        data, deadline = b"", self.clock.now() + wait
        while piece := self.link.read(1000, deadline):
            data += piece
        return data

    def at(self, time):
        self.clock.sleep_until(time)
        return self


GOOD = status(1, 0, *low_high(512))


def test_without_faults_nothing_changes():
    assert Case().ask(1, *POSITION) == GOOD


def test_a_fault_keeps_to_its_window_and_its_servo():
    case = Case(Fault(kind="drop_reply", servo=1, start=1.0, end=2.0))
    assert case.ask(1, *POSITION) == GOOD
    assert case.at(1.0).ask(1, *POSITION) == b""
    assert case.ask(2, PING) == status(2)
    assert case.at(2.0).ask(1, *POSITION) == GOOD
    assert case.faulty.counts == {"drop_reply": 1}


def test_the_nth_and_only_the_nth():
    case = Case(Fault(kind="drop_reply", nth=3))
    assert [bool(case.ask(1, PING)) for _ in range(5)] == [True, True, False, True, True]


def test_probability_is_drawn_from_the_seed():
    def losses(seed):
        case = Case(Fault(kind="drop_reply", probability=0.1), seed=seed)
        return [not case.ask(1, PING, wait=1e-3) for _ in range(500)]

    assert 25 < sum(losses(1)) < 80
    assert losses(1) == losses(1) != losses(2)


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        (Fault(kind="bad_checksum"), GOOD[:-1] + bytes((GOOD[-1] ^ 0x55,))),
        (Fault(kind="truncate_reply", value=3), GOOD[:-3]),
        (Fault(kind="wrong_length"), GOOD[:3] + b"\x05" + GOOD[4:]),
        (Fault(kind="wrong_id"), status(2, 0, *low_high(512))),
        (Fault(kind="wrong_id", value=9), status(9, 0, *low_high(512))),
        (Fault(kind="duplicate_reply"), GOOD + GOOD),
        (Fault(kind="short_status"), status(1)),
        (Fault(kind="range_error"), status(1, RANGE)),
        (Fault(kind="drop_request"), b""),
        (Fault(kind="split_reply"), GOOD),
    ],
    ids=lambda value: value.kind if isinstance(value, Fault) else "",
)
def test_what_arrives_instead_of_a_reply(fault, expected):
    assert Case(fault).ask(1, *POSITION) == expected


def test_a_corrupt_reply_differs_in_one_byte():
    reply = Case(Fault(kind="corrupt_reply")).ask(1, *POSITION)
    assert sum(a != b for a, b in zip(reply, GOOD, strict=True)) == 1


def test_garbage_lies_around_a_reply():
    reply = Case(Fault(kind="garbage", value=7)).ask(1, *POSITION)
    assert len(reply) == len(GOOD) + 14
    assert reply[7:-7] == GOOD


def test_late_and_split_replies_have_their_times():
    case = Case(Fault(kind="late_reply"))
    assert case.ask(1, *POSITION, wait=0.05) == b""
    assert case.listen(0.02) == GOOD
    case = Case(Fault(kind="split_reply", value=0.005))
    case.link.write(packet(1, *POSITION))
    assert case.link.read(100, 0.004) == GOOD[:4]
    assert case.link.read(100, 0.004) == b""
    assert case.link.read(100, 1.0) == GOOD[4:]
    assert case.clock.now() == pytest.approx(16e-5 + 0.005)


def test_a_late_reply_comes_with_the_next():
    case = Case(Fault(kind="late_reply", nth=1, value=0.0105))
    assert case.ask(1, PING) == b""
    assert case.ask(2, PING) == status(2) + status(1)


def test_a_corrupted_sync_write_reaches_nobody_or_is_refused():
    case = Case(Fault(kind="corrupt_sync_write"))
    case.ask(ALL, SYNC_WRITE, 25, 1, 1, 1, 2, 1, 3, 1)
    assert [servo.read(25) for servo in case.line.all] == [0, 0, 0]
    assert case.line.violations > 0
    assert case.at(0.3).ask(1, PING) == status(1)  # another instruction is left alone
    assert case.faulty.counts == {"corrupt_sync_write": 1}


def test_only_the_sync_write_is_corrupted_where_more_follows():
    for seed in range(20):
        case = Case(Fault(kind="corrupt_sync_write"), seed=seed)
        case.link.write(packet(ALL, SYNC_WRITE, 25, 1, 1, 1) + packet(2, PING))
        assert case.line.requests[SYNC_WRITE] == 0


def test_corrupt_requests_are_answered_with_an_error_or_not_at_all():
    case = Case(Fault(kind="corrupt_request"))
    assert case.ask(1, *POSITION) != GOOD


def test_the_latency_timer_hands_replies_on_in_ticks():
    case = Case(Fault(kind="latency_timer"))
    for tick in (1, 2, 3):
        case.link.write(packet(1, PING))
        assert case.link.read(6, 1.0) == status(1)
        assert case.clock.now() == pytest.approx(tick * 0.016)


def test_a_stalled_adapter_lets_nothing_pass_and_then_all():
    case = Case(Fault(kind="stall", start=1.0))
    case.at(1.05).link.write(packet(1, WRITE, 25, 1))
    assert case.listen(0.1) == b""
    assert case.line.servos[1].read(25) == 0
    assert case.listen(0.2) == status(1)
    assert case.line.servos[1].read(25) == 1


def test_a_reply_on_its_way_waits_for_a_stalls_end():
    case = Case(Fault(kind="stall", start=1.0))
    case.at(1.0 - 1e-4).link.write(packet(1, PING))
    assert case.link.read(6, 2.0) == status(1)
    assert case.clock.now() == pytest.approx(1.2)


def test_what_was_on_its_way_is_gone_with_the_adapter():
    case = Case(Fault(kind="late_reply", value=1.0), Fault(kind="usb_lost", start=0.5))
    assert case.ask(1, PING) == b""
    with pytest.raises(LinkLostError):
        case.listen(1.0)
    assert case.faulty.transmit(2.0) == b""


def test_babble_drowns_everything_while_it_lasts():
    case = Case(Fault(kind="babble", start=1.0, end=1.1, value=10_000))
    assert case.ask(1, PING) == status(1)
    noise = case.at(1.0).ask(1, WRITE, 25, 1, wait=0.2)
    assert 950 <= len(noise) <= 1050
    assert case.line.servos[1].read(25) == 0
    assert case.ask(1, PING) == status(1)


def test_babble_that_nobody_listens_to_is_there_afterwards():
    case = Case(Fault(kind="babble", start=1.0, end=1.1, value=10_000))
    assert len(case.at(2.0).listen()) in range(950, 1051)


def test_an_unplugged_servo_comes_back_with_its_ram_lost():
    case = Case(Fault(kind="unplugged", servo=2, start=1.0, end=2.0))
    case.ask(2, WRITE, 30, *low_high(600))
    assert case.at(1.5).ask(2, PING) == b""
    assert case.ask(1, PING) == status(1)
    assert case.at(2.5).ask(2, READ, 24, 1) == status(2, 0, 0)


def test_waiting_alone_lets_faults_begin():
    case = Case(Fault(kind="unplugged", servo=2, start=1.0))
    case.ask(2, WRITE, 30, *low_high(600))
    case.shafts.advance(0.1)
    assert case.shafts.state(1).load != 0.0
    case.listen(2.0)
    angle = case.shafts.state(1).angle
    case.shafts.advance(2.0)
    assert case.shafts.state(1).load == 0.0
    assert case.shafts.state(1).angle == pytest.approx(angle, abs=0.02)
    assert not case.line.servos[2].is_plugged


def test_forced_heat_and_overload_shut_a_servo_down():
    case = Case(
        Fault(kind="temperature", servo=1, start=1.0, end=2.0), Fault(kind="overload", servo=2, start=1.0)
    )
    case.ask(1, WRITE, 30, *low_high(520))
    case.ask(2, WRITE, 30, *low_high(520))
    case.at(1.5)
    assert case.ask(1, READ, 43, 1) == status(1, HEAT, 75)
    assert case.ask(2, PING) == status(2, OVERLOAD)
    assert case.ask(3, PING) == status(3)
    assert [case.line.servos[i].read(34, 2) for i in (1, 2)] == [0, 0]
    assert case.at(2.5).ask(1, PING) == status(1)


def test_a_voltage_ramps_and_comes_back():
    case = Case(Fault(kind="voltage", start=1.0, end=3.0, value=12.0, to=5.0))
    assert case.at(2.0).ask(1, READ, 42, 1) == status(1, 0, 85)
    assert case.shafts.state(0).voltage == pytest.approx(8.5, abs=0.05)
    assert case.at(2.9).ask(1, PING) == status(1, VOLTAGE)
    assert case.at(3.5).ask(1, READ, 42, 1) == status(1, 0, 120)


def test_a_brown_out_restarts_the_servos():
    case = Case(Fault(kind="brown_out", start=1.0, end=1.05))
    case.ask(ALL, WRITE, 24, 1)
    assert case.at(1.04).ask(1, PING, wait=0.001) == b""
    assert case.at(1.3).ask(1, READ, 24, 1) == status(1, 0, 0)
    assert [servo.read(24) for servo in case.line.all] == [0, 0, 0]


def test_a_stuck_switch_leaves_the_power_on():
    case = Case(Fault(kind="power_stuck", start=1.0, end=2.0))
    case.at(1.5).listen()
    case.line.power(False, case.clock.now())
    assert case.ask(1, PING) == status(1)
    case.at(2.5).listen()
    case.line.power(False, case.clock.now())
    assert case.ask(1, PING) == b""


def test_servos_that_are_wrong_from_the_start():
    case = Case(
        Fault(kind="missing", servo=1),
        Fault(kind="wrong_model", servo=2, value=300),
        Fault(kind="register", servo=2, address=8, value=700),
        Fault(kind="wrong_baud", servo=3),
    )
    assert case.ask(1, PING) == b""
    assert case.ask(2, READ, 0, 2) == status(2, 0, *low_high(300))
    assert case.ask(2, READ, 8, 2) == status(2, 0, *low_high(700))
    assert case.ask(3, PING) == b""
    case.faulty.host_baud = 57_600
    assert case.line.host_baud == 57_600
    assert case.ask(3, PING) == status(3)


def test_a_duplicate_id_garbles():
    case = Case(Fault(kind="duplicate_id", servo=3, value=1))
    assert case.ask(1, PING) != status(1)
    assert case.ask(3, PING) == b""
    assert case.line.violation_kinds["overlap"] == 1


def test_times_count_from_the_lines_start():
    case = Case(Fault(kind="drop_reply", start=1.0), start=1000.0)
    assert case.ask(1, PING) == status(1)
    assert case.at(1001.0).ask(1, PING) == b""


@pytest.mark.parametrize("kind", [name for name, kind in KINDS.items() if not kind.servos_only])
def test_faults_of_bytes_act_on_any_device(kind):
    clock = VirtualClock()
    faulty = FaultyLine(Parrot(), FaultPlan(faults=(Fault(kind=kind, device="lidar", end=0.5),)))
    link = MemoryLink(faulty, clock)
    heard = b""
    if kind != "usb_lost":
        link.write(b"BM\n")
        while piece := link.read(1000, 0.6):
            heard += piece
        assert heard != b"BM\n" or kind in ("stall", "split_reply", "late_reply", "latency_timer")
    clock.sleep_until(1.0)
    link.reopen()
    link.write(b"BM\n")
    assert link.read(10, 2.0) == b"BM\n"


def test_a_plan_is_read_from_a_file(tmp_path):
    path = tmp_path / "faults.toml"
    path.write_text(
        'seed = 3\n[[fault]]\nkind = "drop_reply"\nservo = 5\nprobability = 0.1\n'
        '[[fault]]\nkind = "stall"\ndevice = "board"\nstart = 2\n'
    )
    plan = FaultPlan.load(path)
    assert plan.seed == 3
    assert [fault.kind for fault in plan.faults] == ["drop_reply", "stall"]
    assert [fault.kind for fault in plan.on("board").faults] == ["stall"]
    assert plan.on("board").faults[0].stop == 2.2
    assert math.isinf(plan.faults[0].stop)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[[fault]]\nkind = "drop_repli"', "drop_reply"),
        ('[[fault]]\nkind = "drop_reply"\nservos = 1', "servo"),
        ("[[fault]]\nstart = 1", "kind"),
        ('[[fault]]\nkind = "drop_reply"\nprobability = 2.0', "probability"),
        ('[[fault]]\nkind = "drop_reply"\nstart = 3\nend = 2', "after start"),
        ('[[fault]]\nkind = "voltage"', "needs a value"),
        ('[[fault]]\nkind = "voltage"\nvalue = 12\nto = 9', "end"),
        ('[[fault]]\nkind = "unplugged"\ndevice = "lidar"', "acts on servos"),
        ('[[fault]]\nkind = "wrong_baud"', "servo = ID"),
        ('[[fault]]\nkind = "register"\nservo = 1\nvalue = 3', "address"),
        ('[[fault]]\nkind = "babble"\nvalue = 0', "positive"),
        ('[[fault]]\nkind = "missing"\nservo = 1\nstart = 2', "from the start"),
        ("fault = 3", "fault"),
        ('seed = "x"', "seed"),
        ("faults = []", "fault"),
        ("[[fault", "not a TOML file"),
    ],
)
def test_a_wrong_plan_is_refused_with_a_reason(tmp_path, text, message):
    path = tmp_path / "faults.toml"
    path.write_text(text)
    with pytest.raises(ConfigurationError, match=message) as caught:
        FaultPlan.load(path)
    assert str(path) in str(caught.value)


def test_a_fault_of_a_servo_that_is_not_there_is_refused():
    with pytest.raises(ConfigurationError, match="no servo 9.*1, 2, 3"):
        Case(Fault(kind="unplugged", servo=9))
    with pytest.raises(ConfigurationError, match="no register at address 10"):
        Case(Fault(kind="register", servo=1, address=10, value=1))
    with pytest.raises(ConfigurationError, match="does not fit"):
        Case(Fault(kind="register", servo=1, address=5, value=300))


def test_the_page_about_the_emulator_is_right(tmp_path):
    page = (Path(__file__).parents[3] / "docs" / "emulator.md").read_text(encoding="utf-8")
    examples = dict(re.findall(r"```(toml|python)\n(.*?)```", page, re.DOTALL))
    path = tmp_path / "faults.toml"
    path.write_text(examples["toml"])
    assert len(FaultPlan.load(path).faults) == 4
    exec(examples["python"], {})
    table = page[page.index("| kind |") :]
    assert re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE) == list(KINDS)
