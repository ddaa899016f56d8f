"""The watchdog process against a pseudo-terminal: real processes, real signals."""

import os
import select
import signal
import subprocess
import sys
import textwrap
import time
import tty

import pytest

from bluefoot_mpc.exceptions import ConfigurationError, DeviceError
from bluefoot_mpc.io.safety import watchdog
from bluefoot_mpc.io.safety.watchdog import GuardedPort, switch_off
from bluefoot_mpc.io.safety.watchdog_process import TORQUE_OFF, WatchdogProcess

pytestmark = pytest.mark.slow

CUT = b"\xb5cut!"
PATIENCE = 20.0  # s, on a machine that others use as well

PROGRAM = textwrap.dedent(
    """
    import fcntl, os, sys, termios, time
    from bluefoot_mpc.io.safety.watchdog import GuardedPort
    from bluefoot_mpc.io.safety.watchdog_process import TORQUE_OFF, WatchdogProcess

    servos, board, hand_over = sys.argv[1], sys.argv[2], sys.argv[3] == "hand over"
    def opened(path):
        descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY)
        if hand_over:  # else only the administrator could open it a second time
            fcntl.ioctl(descriptor, termios.TIOCEXCL)
        return descriptor
    first, second = opened(servos), opened(board)
    process = WatchdogProcess([
        GuardedPort(servos, 1_000_000, TORQUE_OFF, first if hand_over else -1),
        GuardedPort(board, 115_200, bytes.fromhex(sys.argv[4]), second if hand_over else -1),
    ], timeout=float(sys.argv[5]))
    process.beat()
    print(process.pid, flush=True)
    end = time.monotonic() + 60.0
    while time.monotonic() < end:
        if not process.beat():
            print(process.lost, flush=True)
            break
        time.sleep(0.01)
    """
)


class Port:
    """A pseudo-terminal whose far end is read here."""

    def __init__(self):
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        self.path = os.ttyname(self.slave)

    def read(self, count, seconds=PATIENCE):
        data, end = b"", time.monotonic() + seconds
        while len(data) < count and time.monotonic() < end:
            if select.select([self.master], [], [], 0.05)[0]:
                data += os.read(self.master, 4096)
        return data

    def close(self):
        for descriptor in (self.master, self.slave):
            os.close(descriptor)


@pytest.fixture
def ports():
    made = Port(), Port()
    yield made
    for port in made:
        port.close()


@pytest.fixture
def program(ports):
    """The robot's program, with its watchdog; started on demand, ended for sure."""
    started = []

    def start(how="hand over", timeout=10.0):
        command = [sys.executable, "-c", PROGRAM, ports[0].path, ports[1].path, how, CUT.hex(), str(timeout)]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True)
        started.append(process)
        process.watchdog = int(process.stdout.readline())
        return process

    yield start
    for process in started:
        process.kill()
        process.wait()
        process.stdout.close()
        # It would open the ports by their names, which the next test's may bear.
        assert gone(process.watchdog)


def gone(pid):
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        try:
            os.kill(pid, 0)
            # A process whose parent is gone too may stay as a zombie where nobody reaps it.
            with open(f"/proc/{pid}/stat") as stat:
                if stat.read().rsplit(")", 1)[1].split()[0] == "Z":
                    return True
        except (ProcessLookupError, FileNotFoundError):
            return True
        time.sleep(0.02)
    return False


def expect_off(ports):
    repeats = 2 * watchdog.REPEATS
    assert ports[0].read(repeats * len(TORQUE_OFF)).startswith(repeats * TORQUE_OFF)
    assert ports[1].read(repeats * len(CUT)).startswith(repeats * CUT)


def test_the_torque_off_packet_is_the_manuals():
    assert TORQUE_OFF.hex(" ") == "ff ff fe 04 03 18 00 e2"
    assert TORQUE_OFF[-1] == ~sum(TORQUE_OFF[2:-1]) & 0xFF


@pytest.mark.parametrize("how", ["hand over", "open anew"])
def test_a_program_that_is_killed_leaves_no_torque_on(ports, program, how):
    process = program(how)
    process.send_signal(signal.SIGKILL)
    process.wait()
    expect_off(ports)
    assert gone(process.watchdog)


def test_a_program_that_is_halted_leaves_no_torque_on_and_is_told_when_it_goes_on(ports, program):
    process = program(timeout=0.3)
    os.killpg(process.pid, signal.SIGSTOP)  # as Ctrl-Z does to all of a terminal's foreground
    expect_off(ports)
    os.killpg(process.pid, signal.SIGCONT)
    assert "has switched torque off" in process.stdout.readline()
    # Whatever it wrote before it was told: torque is switched off once more.
    assert ports[0].read(len(TORQUE_OFF)).startswith(TORQUE_OFF)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals_to_the_programs_group_do_not_reach_the_watchdog(ports, program, number):
    process = program()
    os.kill(process.watchdog, number)
    os.killpg(process.pid, number)
    process.wait()
    expect_off(ports)


def test_a_farewell_ends_it_without_a_byte(ports):
    process = WatchdogProcess([GuardedPort(ports[0].path, 1_000_000, TORQUE_OFF, ports[0].slave)], 10.0)
    assert process.beat()
    pid = process.pid
    process.close()
    process.close()
    assert gone(pid)
    assert ports[0].read(1, 0.3) == b""
    assert process.lost == ""


def test_it_waits_for_the_first_heartbeat(ports):
    process = WatchdogProcess([GuardedPort(ports[0].path, 1_000_000, TORQUE_OFF, ports[0].slave)], 0.1)
    assert ports[0].read(1, 0.4) == b""
    process.beat()
    assert ports[0].read(len(TORQUE_OFF)).startswith(TORQUE_OFF)
    process.close()


def test_a_watchdog_that_is_gone_is_noticed(ports):
    process = WatchdogProcess([GuardedPort(ports[0].path, 1_000_000, TORQUE_OFF)], 10.0)
    assert process.beat()
    os.kill(process.pid, signal.SIGKILL)
    end = time.monotonic() + PATIENCE
    while not process.lost and time.monotonic() < end:
        assert process.beat()
        time.sleep(0.01)
    assert process.lost == "the watchdog process is gone"
    assert process.beat()  # nothing was switched off: the robot may still sit down
    process.close()


def test_a_port_that_was_opened_anew_is_used(ports):
    old, new = ports
    process = WatchdogProcess([GuardedPort("/nowhere", 1_000_000, TORQUE_OFF, old.slave)], 0.3)
    process.replace(0, new.slave)
    process.beat()
    assert new.read(len(TORQUE_OFF)).startswith(TORQUE_OFF)
    assert old.read(1, 0.1) == b""
    process.close()


def test_a_watchdog_that_does_not_start_is_an_error():
    with pytest.raises(DeviceError, match="did not report"):
        WatchdogProcess([GuardedPort("/dev/null", "fast", TORQUE_OFF)])


@pytest.mark.parametrize("timeout", [0.0, -1.0, float("nan")])
def test_the_timeout_must_be_positive(timeout):
    with pytest.raises(ConfigurationError, match="timeout"):
        WatchdogProcess([], timeout)


def test_a_dead_descriptor_is_replaced_by_opening_the_port(ports):
    reading, writing = os.pipe()
    os.close(reading)
    port = GuardedPort(ports[0].path, 1_000_000, TORQUE_OFF, writing)
    assert switch_off([port])
    assert ports[0].read(len(TORQUE_OFF)).startswith(TORQUE_OFF)
    os.close(port.descriptor)


def test_a_port_that_cannot_be_written_does_not_keep_others_waiting(ports):
    nowhere = GuardedPort("/nowhere/at/all", 1_000_000, TORQUE_OFF)
    good = GuardedPort(ports[0].path, 1_000_000, TORQUE_OFF)
    assert not switch_off([nowhere, good])
    assert ports[0].read(6 * len(TORQUE_OFF)) == 6 * TORQUE_OFF
    os.close(good.descriptor)


def test_the_module_runs_by_name_and_says_what_it_needs():
    command = [sys.executable, "-m", "bluefoot_mpc.io.safety.watchdog", "--help"]
    told = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    assert "--channel" in told.stdout
    assert told.stderr == ""


def test_a_program_that_does_not_know_whether_torque_is_off_leaves_it_to_the_watchdog(ports):
    process = WatchdogProcess([GuardedPort(ports[0].path, 1_000_000, TORQUE_OFF, ports[0].slave)], 10.0)
    assert process.beat()
    process.close(is_off=False)
    assert ports[0].read(6 * len(TORQUE_OFF)) == 6 * TORQUE_OFF
    assert gone(process.pid)
