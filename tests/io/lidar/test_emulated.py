"""The emulated URG-04LX byte by byte, as the SCIP 2.0 specification has it."""

import numpy as np
import pytest

from bluefoot_mpc.io.emulation.lidar import EmulatedLidar, LidarTimes

QUICK = LidarTimes(byte_time=1e-9, latency=0.0)


class Wall:
    def scan(self, time):
        return np.arange(682) * 6 + 1500


class Terminal:
    """Sends a line and gives what comes back within a while."""

    def __init__(self):
        self.lidar = EmulatedLidar(Wall(), QUICK)
        self.time = 0.3

    def __call__(self, line, wait=0.01):
        self.lidar.receive(line.encode() + b"\n", self.time)
        self.time += wait
        return self.lidar.transmit(self.time)


@pytest.fixture
def ask():
    return Terminal()


def test_version_and_parameters(ask):
    lines = ask("VV").split(b"\n")
    assert lines[:3] == [b"VV", b"00P", b"VEND:Hokuyo Automatic Co.,Ltd.;["]
    assert b"PROT:SCIP 2.0;N" in lines
    assert lines[-2:] == [b"", b""]
    parameters = ask("PP").split(b"\n")
    for line in (
        b"DMIN:20;",
        b"DMAX:5600;",
        b"ARES:1024;",
        b"AMIN:44;",
        b"AMAX:725;",
        b"AFRT:384;",
        b"SCAN:600;",
    ):
        assert any(found[:-1] == line for found in parameters)
    assert b"LASR:OFF;" in ask("II")
    ask("BM")
    assert b"LASR:ON;" in ask("II")


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("BM", b"BM\n00P\n\n"),
        ("QT", b"QT\n00P\n\n"),
        ("RS", b"RS\n00P\n\n"),
        ("SCIP2.0", b"SCIP2.0\n00P\n\n"),
        ("XX", b"XX\n0Ee\n\n"),
        ("TM9", b"TM9\n01Q\n\n"),
        ("TM1", b"TM1\n04T\n\n"),
        ("TM2", b"TM2\n03S\n\n"),
        ("SS115200", b"SS115200\n00P\n\n"),
        ("SS019200", b"SS019200\n03S\n\n"),
        ("SS123456", b"SS123456\n02R\n\n"),
        ("SSabcdef", b"SSabcdef\n01Q\n\n"),
        ("CR05", b"CR05\n00P\n\n"),
        ("CR00", b"CR00\n03S\n\n"),
        ("CR11", b"CR11\n02R\n\n"),
        ("CRxx", b"CRxx\n01Q\n\n"),
        ("GD0044072501", b"GD0044072501\n10Q\n\n"),
        ("MDxx44072501000", b"MDxx44072501000\n01Q\n\n"),
        ("MD0044xx2501000", b"MD0044xx2501000\n02R\n\n"),
        ("MD00440725xx000", b"MD00440725xx000\n03S\n\n"),
        ("MD0044072601000", b"MD0044072601000\n04T\n\n"),
        ("MD0100004401000", b"MD0100004401000\n05U\n\n"),
        ("MD0044072501x00", b"MD0044072501x00\n06V\n\n"),
        ("MD00440725010xx", b"MD00440725010xx\n07W\n\n"),
    ],
)
def test_short_answers(ask, line, answer):
    assert ask(line) == answer


def test_the_laser_is_on_once(ask):
    assert ask("BM") == b"BM\n00P\n\n"
    assert ask("BM") == b"BM\n02R\n\n"
    assert ask("QT") == b"QT\n00P\n\n"
    assert ask("BM") == b"BM\n00P\n\n"


def test_time_is_told_in_adjust_mode_only(ask):
    assert ask("TM0") == b"TM0\n00P\n\n"
    assert ask("TM0") == b"TM0\n02R\n\n"
    # 320 ms and a bit: 0x140 in four characters is 0 0 5 0.
    assert ask("TM1") == b"TM1\n00P\n0050" + bytes([(48 + 48 + 53 + 48 & 63) + 48]) + b"\n\n"
    assert ask("VV") == b"VV\n0Bb\n\n"
    assert ask("TM2") == b"TM2\n00P\n\n"


def test_one_scan_in_three_and_in_two_characters(ask):
    ask("BM")
    ask.time = 0.5
    reply = ask("GD0044072501").split(b"\n")
    # The sweep that ended at 0.4708 s began at 0.4 s: 0x190.
    assert reply[:3] == [b"GD0044072501", b"00P", b"006@" + bytes([(48 + 48 + 54 + 64 & 63) + 48])]
    assert [len(line) for line in reply[3:]] == [65] * 31 + [63, 0, 0]
    # 1500 is 0, 23, 28.
    assert reply[3][:3] == bytes([48, 48 + 23, 48 + 28])
    reply = ask("GS0044072501").split(b"\n")
    assert sum(len(line) - 1 for line in reply[3:-2]) == 2 * 682
    assert reply[3][:2] == bytes([48 + 23, 48 + 28])


def test_clusters_take_the_nearest(ask):
    ask("BM")
    reply = ask("GD0044005304").split(b"\n")
    # Ten steps in clusters of four: 1500, 1524 and 1548.
    values = [(a - 48 << 12) + (b - 48 << 6) + c - 48 for a, b, c in (reply[3][k : k + 3] for k in (0, 3, 6))]
    assert values == [1500, 1524, 1548]


def test_a_number_of_scans_counts_down_and_ends(ask):
    line = ask("MD0044072501003", wait=1.0)
    assert line.startswith(b"MD0044072501003\n00P\n\n")
    echoes = [reply.split(b"\n")[0] for reply in line.split(b"\n\n")[1:-1]]
    assert echoes == [b"MD0044072501002", b"MD0044072501001", b"MD0044072501000"]


def test_scans_left_out_between_two(ask):
    line = ask("MD0044072501200", wait=1.2)
    assert 3 <= line.count(b"\n99b\n") <= 4


def test_endless_scans_of_2137_bytes_until_quit(ask):
    first = ask("MD0044072501000", wait=0.2)
    assert len(first) == len(b"MD0044072501000\n00P\n\n") + 2 * 2137
    assert ask("QT", wait=0.5) == b"QT\n00P\n\n"


def test_reset_ends_everything(ask):
    ask("MD0044072501000", wait=0.05)
    ask("CR05")
    ask("RS", wait=0.3)
    assert b"LASR:OFF;" in ask("II")
    assert ask("CR05") == b"CR05\n00P\n\n"


def test_bytes_take_their_time():
    lidar = EmulatedLidar(Wall(), LidarTimes(byte_time=0.001, latency=0.002))
    lidar.receive(b"QT\n", 1.0)
    assert lidar.due() == pytest.approx(1.003)
    assert lidar.transmit(1.0029) == b""
    assert lidar.transmit(1.0051) == b"QT\n"
    assert lidar.transmit(1.1) == b"00P\n\n"
    assert lidar.due() == np.inf


def test_commands_may_come_in_pieces_and_with_any_line_end():
    lidar = EmulatedLidar(Wall(), QUICK)
    for time, piece in enumerate((b"V", b"V\r\nQ", b"T\r")):
        lidar.receive(piece, float(time))
    assert lidar.transmit(3.0).endswith(b"QT\n00P\n\n")
