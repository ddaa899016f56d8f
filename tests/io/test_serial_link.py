import os
import termios
import threading
import time
import tty

import pytest

from bluefoot_mpc.io import serial_link
from bluefoot_mpc.io.clock import MonotonicClock
from bluefoot_mpc.io.link import LinkError, LinkLostError
from bluefoot_mpc.io.serial_link import SerialLink

CLOCK = MonotonicClock()


@pytest.fixture
def terminal():
    """Both ends of a pseudo-terminal: (descriptor of the far end, name of the port)."""
    far, near = os.openpty()
    tty.setraw(near)
    name = os.ttyname(near)
    os.close(near)
    yield far, name
    os.close(far)


@pytest.fixture
def link(terminal):
    made = SerialLink(terminal[1], 1_000_000, CLOCK)
    yield made
    made.close()


def test_bytes_go_both_ways(terminal, link):
    link.write(b"\xff\xff\x01\x02\x0d\x0a\x11\x13")
    assert os.read(terminal[0], 100) == b"\xff\xff\x01\x02\x0d\x0a\x11\x13"
    os.write(terminal[0], b"\xff\x03\x0d\x0a\x00")
    assert link.read(3, CLOCK.now() + 1.0) == b"\xff\x03\x0d"
    assert link.read(100, CLOCK.now() + 1.0) == b"\x0a\x00"


def test_a_read_ends_at_its_deadline_without_spinning(link):
    begun, worked = CLOCK.now(), time.process_time()
    assert link.read(10, begun + 0.05) == b""
    assert CLOCK.now() - begun >= 0.05
    assert time.process_time() - worked < 0.04


def test_a_deadline_that_is_past_gives_what_waits(terminal, link):
    assert link.read(10, 0.0) == b""
    os.write(terminal[0], b"abc")
    link.read(1, CLOCK.now() + 1.0)
    assert link.read(10, 0.0) == b"bc"


def test_discard(terminal, link):
    os.write(terminal[0], b"old")
    link.read(1, CLOCK.now() + 1.0)
    link.discard()
    assert link.read(10, 0.0) == b""


def test_a_port_is_opened_for_oneself(terminal, link):
    with pytest.raises(LinkError, match=rf"{terminal[1]} is busy: another program has it open"):
        SerialLink(terminal[1], 1_000_000, CLOCK)
    link.close()
    SerialLink(terminal[1], 1_000_000, CLOCK).close()


def test_no_such_port_names_those_that_exist(monkeypatch):
    monkeypatch.setattr(serial_link, "available_ports", lambda: ["/dev/ttyUSB7"])
    with pytest.raises(LinkError, match=r"no port /dev/nothing\. Ports that exist: /dev/ttyUSB7"):
        SerialLink("/dev/nothing", 1_000_000, CLOCK)
    monkeypatch.setattr(serial_link, "available_ports", list)
    with pytest.raises(LinkError, match="none: check the USB cable"):
        SerialLink("/dev/nothing", 1_000_000, CLOCK)


def test_no_permission_names_the_group(terminal, monkeypatch):
    def denied(*_, **__):
        raise serial_link.serial.SerialException(13, "could not open port")

    monkeypatch.setattr(serial_link.serial, "Serial", denied)
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(LinkError, match=r"Join group '\w+' \(sudo usermod -aG \w+ \$USER\)"):
        SerialLink(terminal[1], 1_000_000, CLOCK)


def test_a_file_is_no_port(tmp_path):
    path = tmp_path / "file"
    path.write_text("")
    with pytest.raises(LinkError, match="is no serial port"):
        SerialLink(str(path), 1_000_000, CLOCK)


def test_a_rate_that_the_adapter_does_not_take(terminal, monkeypatch):
    def slower(_fd, request, buffer=None):
        if request == serial_link._TCGETS2:
            buffer[serial_link._OUTPUT_SPEED] = 115200

    monkeypatch.setattr(serial_link.fcntl, "ioctl", slower)
    with pytest.raises(LinkError, match=r"refuses 1000000 bit/s \(it took 115200 instead\)"):
        SerialLink(terminal[1], 1_000_000, CLOCK)
    monkeypatch.undo()
    with pytest.raises(LinkError, match="refuses -5 bit/s"):
        SerialLink(terminal[1], -5, CLOCK)


def test_a_lost_port_comes_back(tmp_path):
    far, near = os.openpty()
    name = tmp_path / "port"
    name.symlink_to(os.ttyname(near))
    os.close(near)
    link = SerialLink(str(name), 1_000_000, CLOCK)
    threading.Timer(0.05, os.close, (far,)).start()
    with pytest.raises(LinkLostError, match="is gone: unplugged"):
        link.read(10, CLOCK.now() + 5.0)
    with pytest.raises(LinkLostError):
        link.write(b"a")
    with pytest.raises(LinkLostError):
        link.read(1, 0.0)
    with pytest.raises(LinkLostError):
        link.discard()
    name.unlink()
    with pytest.raises(LinkError, match="no port"):
        link.reopen()
    far, near = os.openpty()
    name.symlink_to(os.ttyname(near))
    os.close(near)
    link.reopen()
    link.write(b"again")
    assert os.read(far, 10) == b"again"
    link.close()
    link.close()
    os.close(far)


def test_an_adapter_that_takes_nothing_counts_as_lost(terminal, link, monkeypatch):
    monkeypatch.setattr(serial_link, "WRITE_PATIENCE", 0.05)
    with pytest.raises(LinkLostError, match="takes no more bytes"):
        link.write(bytes(1 << 18))


def test_a_terminal_has_no_latency_timer(link):
    assert link.latency_timer_ms() is None
    assert link.set_low_latency() is False


def test_latency_timer_of_an_adapter(terminal, link, tmp_path, monkeypatch):
    monkeypatch.setattr(serial_link, "SYSFS", tmp_path)
    timer = tmp_path / os.path.basename(terminal[1]) / "device" / "latency_timer"
    timer.parent.mkdir(parents=True)
    timer.write_text("16\n")
    assert link.latency_timer_ms() == 16.0
    assert link.set_low_latency() is True
    assert link.latency_timer_ms() == 1.0
    timer.write_text("16\n")
    link.reopen()
    assert link.latency_timer_ms() == 1.0


def test_line_is_raw(terminal, link):
    flags = termios.tcgetattr(link.fileno())
    assert not flags[3] & (termios.ECHO | termios.ICANON | termios.ISIG)
    assert not flags[0] & (termios.IXON | termios.ICRNL)
