import pytest

from bluefoot_mpc.io.clock import VirtualClock
from bluefoot_mpc.io.dynamixel.arming import arm, broadcast_off, check_servos, torque_off
from bluefoot_mpc.io.dynamixel.bus import ServoBus
from bluefoot_mpc.io.dynamixel.codec import ErrorBit, Instruction
from bluefoot_mpc.io.dynamixel.latch import Latch
from bluefoot_mpc.io.dynamixel.layout import ServoLayout, spread
from bluefoot_mpc.io.emulation.faults import Fault, FaultPlan
from bluefoot_mpc.io.emulation.faults_line import FaultyLine
from bluefoot_mpc.io.emulation.memory_link import MemoryLink
from bluefoot_mpc.io.emulation.own_shafts import OwnShafts
from bluefoot_mpc.io.emulation.servo_line import ServoLine
from bluefoot_mpc.io.findings import NotArmedError, Severity
from tests.io.dynamixel.fakes import FakeLine

LAYOUT = ServoLayout()


class Emulated:
    """The emulator of the project, as a robot is set up."""

    def __init__(self):
        self.clock = VirtualClock()
        self.line = ServoLine(OwnShafts(16), LAYOUT.ids)
        for servo in self.line.all:
            servo.write(5, 0)
        self.bus = ServoBus(MemoryLink(self.line, self.clock), self.clock)

    def check(self):
        return check_servos([self.bus], LAYOUT)

    def refusals(self):
        return [f for f in self.check() if f.severity is Severity.REFUSAL]

    def torques(self):
        return [servo.read(24) for servo in self.line.all]


def fake():
    line = FakeLine()
    return ServoBus(line, line.clock), line


def test_a_good_robot_has_no_refusals():
    robot = Emulated()
    findings = robot.check()
    assert not robot.refusals(), robot.refusals()
    assert len(findings) == 17
    assert "AX-12A, firmware" in findings[0].text
    assert "no latency timer" in findings[-1].text
    assert robot.line.eeprom_writes == 0
    assert robot.line.violations == 0


@pytest.mark.parametrize(
    ("address", "value", "size", "words"),
    [
        (0, 24, 2, "model 24 is not the AX-12A"),
        (5, 250, 1, "return delay is 250"),
        (6, 200, 2, "angle limits 200..1023"),
        (8, 900, 2, "angle limits 0..900"),
        (16, 1, 1, "status return level is 1"),
        (18, 37, 1, "shutdown mask is 37"),
        (18, 4, 1, "shutdown mask is 4"),
        (11, 85, 1, "temperature limit is 85"),
        (14, 500, 2, "max torque is 500"),
    ],
)
def test_a_register_that_is_not_set_up(address, value, size, words):
    robot = Emulated()
    robot.line.servos[6].write(address, value, size)
    (finding,) = robot.refusals()
    assert words in finding.text
    assert finding.part == "servo 6 (FR_hip_pitch)"
    assert finding.mend


def test_wheel_mode_is_refused():
    robot = Emulated()
    robot.line.servos[6].write(6, 0, 2)
    robot.line.servos[6].write(8, 0, 2)
    (finding,) = robot.refusals()
    assert "like a wheel" in finding.text


def test_state_of_today():
    robot = Emulated()
    robot.line.servos[1].forced_temperature = 64.0
    robot.line.servos[2].forced_voltage = 10.1
    robot.line.servos[3].forced_overload = True
    robot.line.servos[4].forced_voltage = 10.5
    hot, empty, loaded = robot.refusals()
    assert "64 °C" in hot.text
    assert "10.1 V is below" in empty.text
    assert "its load is more" in loaded.text
    (low,) = [finding for finding in robot.check() if finding.severity is Severity.WARNING]
    assert "10.5 V is below 10.8 V" in low.text


def test_a_missing_servo_and_an_id_given_twice():
    robot = Emulated()
    robot.line.servos[9].write(3, 8)
    findings = robot.refusals()
    assert [finding.part for finding in findings] == ["servo 8 (FR_ankle)", "servo 9 (RL_hip_yaw)"]
    assert "perhaps two servos have ID 8" in findings[0].text
    assert "no reply" in findings[1].text


def test_a_slow_adapter_is_refused_by_what_it_says_and_by_what_is_measured():
    bus, line = fake()
    line.latency_timer_ms = lambda: 16.0
    assert any("latency timer is 16 ms" in f.text for f in check_servos([bus], LAYOUT))
    line.latency_timer_ms = lambda: 4.0
    port = check_servos([bus], LAYOUT)[-1]
    assert port.severity is Severity.WARNING
    bus, line = fake()
    line.change = lambda servo, reply: [(0.016, reply)]
    refused = [f for f in check_servos([bus], LAYOUT) if f.severity is Severity.REFUSAL]
    assert len(refused) == 1
    assert "answers take 16.0 ms" in refused[0].text


def test_an_emulated_latency_timer_of_16_ms_is_the_only_refusal():
    clock, line = VirtualClock(), Emulated().line
    plan = FaultPlan(faults=(Fault(kind="latency_timer"),))
    bus = ServoBus(MemoryLink(FaultyLine(line, plan), clock), clock)
    (finding,) = [f for f in check_servos([bus], LAYOUT) if f.severity is Severity.REFUSAL]
    assert "a latency timer of 16 ms" in finding.text
    assert "latency_timer" in finding.mend


def test_arming_holds_where_the_joints_are():
    robot = Emulated()
    arm([robot.bus], LAYOUT, 0.3)
    assert robot.torques() == [1] * 16
    for servo in robot.line.all:
        assert servo.read(30, 2) == servo.read(36, 2)
        assert servo.read(34, 2) == 307
    assert robot.line.goal_writes_while_off == 16  # the goal switched torque on, with the low limit in force
    assert robot.line.eeprom_writes == 0


def test_limit_before_goal_before_enable():
    bus, line = fake()
    arm([bus], LAYOUT, 0.3)
    writes = [p.parameters[0] for p in line.sent if p.id == 5 and p.instruction == Instruction.WRITE]
    assert writes == [34, 32, 30, 24]


def test_one_servo_that_refuses_leaves_all_limp():
    robot = Emulated()
    robot.line.plug(robot.line.servos[11], False, robot.clock.now())
    with pytest.raises(NotArmedError, match=r"servo 11 \(RL_knee\): .*no reply"):
        arm([robot.bus], LAYOUT, 0.3)
    assert robot.torques()[:10] == [0] * 10
    assert robot.torques()[11:] == [0] * 5


def test_a_register_that_does_not_hold_is_refused():
    bus, line = fake()
    store = line._store

    def forgetful(servo, address, data):
        store(servo, address, data)
        if servo == 4 and address == 24:
            line.tables[4][34:36] = b"\x00\x00"

    line._store = forgetful
    with pytest.raises(
        NotArmedError, match=r"servo 4 \(FL_ankle\): torque limit is 0 after arming instead of 307"
    ):
        arm([bus], LAYOUT, 0.3)
    assert not any(table[24] for table in line.tables.values())


def test_an_emergency_during_arming():
    bus, line = fake()
    seen = []

    def stop_in_the_middle(servo, reply):
        seen.append(servo)
        if len(seen) == 40:
            bus.latch.close("emergency stop")
        return [(0.0, reply)]

    line.change = stop_in_the_middle
    with pytest.raises(NotArmedError, match="emergency stop"):
        arm([bus], LAYOUT, 0.3)
    assert not any(table[24] for table in line.tables.values())


def test_torque_off_is_sent_three_times_and_verified():
    robot = Emulated()
    arm([robot.bus], LAYOUT, 0.3)
    robot.bus.latch.close("test")
    before = robot.line.requests[Instruction.WRITE]
    (finding,) = torque_off([robot.bus], LAYOUT)
    assert finding.severity is Severity.OK
    assert robot.torques() == [0] * 16
    assert robot.line.requests[Instruction.WRITE] - before == 3


def test_torque_off_names_servos_that_do_not_confirm():
    bus, line = fake()
    arm([bus], LAYOUT, 0.3)
    line.tables.pop(12)
    (finding,) = torque_off([bus], LAYOUT)
    assert finding.part == "servo 12 (RL_ankle)"
    assert "not known whether its torque is off" in finding.text


def test_torque_off_never_raises():
    bus, line = fake()
    line.is_gone = True
    findings = torque_off([bus], LAYOUT)
    assert len(findings) == 17
    assert "cannot be sent" in findings[0].text


def test_ten_percent_loss_does_not_keep_from_arming():
    bus, line = fake()
    count = iter(range(10**6))
    line.change = lambda servo, reply: [] if next(count) % 10 == 3 else [(0.0, reply)]
    arm([bus], LAYOUT, 0.3)
    assert all(table[24] for table in line.tables.values())
    assert torque_off([bus], LAYOUT)[0].severity is Severity.OK


def test_two_ports():
    clock, latch = VirtualClock(), Latch()
    lines = [FakeLine(clock, range(1, 9)), FakeLine(clock, range(9, 17))]
    buses = [ServoBus(line, clock, latch=latch) for line in lines]
    assert not [f for f in check_servos(buses, spread(2)) if f.severity is Severity.REFUSAL]
    arm(buses, spread(2), 0.2)
    assert all(table[24] for line in lines for table in line.tables.values())
    assert not broadcast_off(buses)
    assert not any(table[24] for line in lines for table in line.tables.values())


def test_error_bits_are_refused():
    bus, line = fake()
    line.errors[2] = int(ErrorBit.OVERHEATING)
    (finding,) = [f for f in check_servos([bus], LAYOUT) if f.severity is Severity.REFUSAL]
    assert "too hot" in finding.text
