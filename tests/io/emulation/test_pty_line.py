"""The emulator on a pseudo-terminal, driven by ROBOTIS' own client."""

import os
import sys
import threading
import time
from pathlib import Path

import pytest

from bluefoot_mpc.exceptions import ConfigurationError, SimulationError
from bluefoot_mpc.io.emulation.own_shafts import OwnShafts
from bluefoot_mpc.io.emulation.pty_line import PtyLine
from bluefoot_mpc.io.emulation.servo_line import ServoLine
from tests.io.emulation.bench import PING, packet, status

sdk = pytest.importorskip("dynamixel_sdk", reason="ROBOTIS' client is not installed")

ANGLE, RANGE, SUM, INSTRUCTION = 2, 8, 16, 64


@pytest.fixture(scope="module")
def line():
    line = ServoLine(OwnShafts(3), (1, 2, 3))
    for servo in line.all:
        servo.write(5, 0)
    return line


@pytest.fixture(scope="module")
def pty(line):
    with PtyLine(line) as pty:
        yield pty


@pytest.fixture(autouse=True)
def _patience(monkeypatch):
    """The client spins, in the same interpreter: let the emulator's thread come to its turn."""
    monkeypatch.setattr("dynamixel_sdk.port_handler.LATENCY_TIMER", 150)
    kept = sys.getswitchinterval()
    sys.setswitchinterval(2e-4)
    yield
    sys.setswitchinterval(kept)


@pytest.fixture
def port(pty):
    port = sdk.PortHandler(pty.port)
    port.baudrate = 1_000_000
    port.openPort()
    yield port
    port.closePort()


@pytest.fixture
def client():
    return sdk.PacketHandler(1.0)


def test_ping_tells_the_model(port, client):
    assert client.ping(port, 1) == (12, sdk.COMM_SUCCESS, 0)


def test_reads_of_one_and_two_bytes(port, client):
    assert client.read2ByteTxRx(port, 2, 0) == (12, sdk.COMM_SUCCESS, 0)
    assert client.read1ByteTxRx(port, 2, 3) == (2, sdk.COMM_SUCCESS, 0)
    data, result, error = client.readTxRx(port, 3, 36, 8)
    assert (len(data), result, error) == (8, sdk.COMM_SUCCESS, 0)


def test_a_write_moves_the_shaft(port, client):
    assert client.write2ByteTxRx(port, 1, 30, 560) == (sdk.COMM_SUCCESS, 0)
    deadline = time.monotonic() + 5.0
    position = 0
    while abs(position - 560) > 4 and time.monotonic() < deadline:
        time.sleep(0.02)
        position, result, _ = client.read2ByteTxRx(port, 1, 36)
        assert result == sdk.COMM_SUCCESS
    assert abs(position - 560) <= 4
    assert client.read1ByteTxRx(port, 1, 24)[0] == 1


def test_registered_writes_and_action(port, client, line):
    assert client.regWriteTxRx(port, 2, 30, 2, [0x20, 0x02]) == (sdk.COMM_SUCCESS, 0)
    assert client.read1ByteTxRx(port, 2, 44)[0] == 1
    client.action(port, sdk.BROADCAST_ID)
    assert client.read1ByteTxRx(port, 2, 44)[0] == 0
    assert line.servos[2].read(30, 2) == 0x220


def test_sync_write(port, client):
    group = sdk.GroupSyncWrite(port, client, 30, 4)
    for identity in (1, 2, 3):
        assert group.addParam(identity, [0, 2, 50 + identity, 0])
    assert group.txPacket() == sdk.COMM_SUCCESS
    for identity in (1, 2, 3):
        assert client.read2ByteTxRx(port, identity, 32)[0] == 50 + identity


def test_errors_reach_the_client(port, client):
    assert client.write2ByteTxRx(port, 3, 30, 1500) == (sdk.COMM_SUCCESS, RANGE)
    assert client.write1ByteTxRx(port, 3, 43, 1) == (sdk.COMM_SUCCESS, RANGE)
    client.write2ByteTxRx(port, 3, 6, 200)
    assert client.write2ByteTxRx(port, 3, 30, 100) == (sdk.COMM_SUCCESS, ANGLE)
    _, result, error = client.txRxPacket(port, [0, 0, 3, 2, 0x33, 0])
    assert (result, error) == (sdk.COMM_SUCCESS, INSTRUCTION)
    # The client never sends a wrong sum of its own accord.
    port.writePort(bytes((0xFF, 0xFF, 3, 2, 1, 0)))
    port.setPacketTimeout(6)
    reply, result = client.rxPacket(port)
    assert result == sdk.COMM_SUCCESS
    assert bytes(reply) == status(3, SUM)


def test_a_missing_servo_times_out(port, client):
    assert client.ping(port, 9) == (0, sdk.COMM_RX_TIMEOUT, 0)


def test_the_wrong_baud_rate_is_not_understood(port, client, pty, line):
    port.setBaudRate(57_600)
    assert client.ping(port, 1)[1] == sdk.COMM_RX_TIMEOUT
    assert pty.baud == 57_600
    port.setBaudRate(1_000_000)
    assert client.ping(port, 1)[1] == sdk.COMM_SUCCESS
    assert pty.baud == line.host_baud == 1_000_000


class Echo:
    """A device without a baud rate, which answers at once; it may break."""

    def __init__(self):
        self.waiting = b""
        self.asked = 0

    def receive(self, data, time):
        if data == b"break":
            raise SimulationError("the physics gave up")
        self.waiting += data

    def due(self):
        self.asked += 1
        return 0.0 if self.waiting else float("inf")

    def transmit(self, time):
        data, self.waiting = self.waiting, b""
        return data


def fetch(descriptor, count, seconds=5.0):
    """Bytes from a descriptor that does not block."""
    data, deadline = b"", time.monotonic() + seconds
    while len(data) < count and time.monotonic() < deadline:
        try:
            data += os.read(descriptor, count - len(data))
        except BlockingIOError:
            time.sleep(0.002)
    return data


def keep_asking(descriptor, seconds=5.0):
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        os.write(descriptor, packet(1, PING))
        time.sleep(0.01)


def opened(path):
    return os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)


def test_any_device_is_served_and_nothing_spins():
    device = Echo()
    with PtyLine(device) as pty:
        client = opened(pty.port)
        os.write(client, b"\x00\x03\x11\x13\x0a\xff")  # signs that a terminal would swallow
        assert fetch(client, 6) == b"\x00\x03\x11\x13\x0a\xff"
        before = device.asked
        time.sleep(0.1)
        assert device.asked - before <= 2
        os.close(client)
        thread = pty._thread
    assert not thread.is_alive()
    pty.close()


def test_a_link_points_to_the_port(tmp_path):
    link = tmp_path / "servos"
    link.symlink_to("/dev/pts/gone")
    with PtyLine(Echo(), link=link) as pty:
        assert pty.port == str(link)
        assert os.readlink(link) == pty.terminal
    assert not link.is_symlink()


def test_a_link_that_cannot_be_made_is_refused(tmp_path):
    threads = threading.active_count()
    (tmp_path / "file").touch()
    with pytest.raises(ConfigurationError, match="is not a link"):
        PtyLine(Echo(), link=tmp_path / "file")
    with pytest.raises(ConfigurationError, match="cannot be made"):
        PtyLine(Echo(), link=tmp_path / "no" / "where")
    assert threading.active_count() == threads


def test_a_device_that_breaks_hangs_up_and_says_why():
    pty = PtyLine(Echo())
    client = opened(pty.port)
    os.write(client, b"break")
    pty._thread.join(5.0)
    assert isinstance(pty.error, SimulationError)
    assert not pty.is_serving
    with pytest.raises(OSError, match="Input/output"):
        os.write(client, b"x")
    os.close(client)
    pty.close()


class Adapter(Echo):
    """A device behind an adapter that a test pulls and plugs in again."""

    gone = False

    def hung_up(self, time):
        return self.gone

    def due(self):
        return time.monotonic() + 0.01 if self.gone else super().due()


def test_an_adapter_that_is_lost_hangs_up_and_comes_back_under_its_link(tmp_path):
    device, link = Adapter(), tmp_path / "servos"
    with PtyLine(device, link=link) as pty:
        client = opened(link)
        os.write(client, b"one")
        assert fetch(client, 3) == b"one"
        device.gone = True
        with pytest.raises(OSError, match="Input/output"):
            keep_asking(client)
        os.close(client)
        assert pty.is_serving
        device.gone = False
        deadline = time.monotonic() + 5.0
        while not Path(link).exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        client = opened(link)
        os.write(client, b"two")
        assert fetch(client, 3) == b"two"
        os.close(client)
