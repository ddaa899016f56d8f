"""The page of the protocol says what the code does."""

import re
from pathlib import Path

import pytest

from bluefoot_mpc.io.board.config import BoardConfig
from bluefoot_mpc.io.board.framing import decode_frame, encode_frame
from bluefoot_mpc.io.board.messages import (
    POWER_MAGIC,
    CutReason,
    Hello,
    ImuSample,
    Kind,
    Power,
    Refusal,
    Switches,
    TimeReply,
    decode,
)

PAGE = (Path(__file__).parents[3] / "docs" / "board-protocol.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^\| ([A-Z_]+), (?:sequence )?(\d+)[^|]*\| `([0-9a-f ]+)` \|$", PAGE, re.MULTILINE)


def test_every_message_has_a_row_and_an_example():
    rows = dict(re.findall(r"^\| (0x[0-9A-F]{2}) \| ([A-Z_]+) \|", PAGE, re.MULTILINE))
    assert {int(number, 16): name for number, name in rows.items()} == {int(k): k.name for k in Kind}
    assert {name for name, _, _ in EXAMPLES} == {kind.name for kind in Kind}


@pytest.mark.parametrize(("name", "sequence", "text"), EXAMPLES)
def test_examples_are_frames_of_what_they_say(name, sequence, text):
    line = bytes.fromhex(text)
    assert line[-1] == 0
    frame = decode_frame(line[:-1])
    assert (Kind(frame.kind).name, frame.sequence) == (name, int(sequence))
    assert encode_frame(frame.kind, frame.sequence, frame.payload) == line


def test_examples_from_the_board_carry_the_values_that_stand_there():
    found = [decode(decode_frame(bytes.fromhex(text)[:-1])) for _, number, text in EXAMPLES[:8]]
    hello, imu, field, switches, power, time, code, refused = found
    assert hello == Hello(1, (1, 0), 7, 1500, True)
    assert isinstance(imu, ImuSample)
    assert imu.count == 1_000_000
    assert imu.gyro == pytest.approx((0.012, -0.003, 0.25))
    assert imu.accel == pytest.approx((0.1, -0.2, 9.81))
    assert field.magnetometer == pytest.approx((0.42, 0.01, -0.9))
    assert switches == Switches(1_005_000, (True, False, False, True), (4, 3, 3, 4))
    assert isinstance(power, Power)
    assert (power.voltage, power.current, power.temperature) == pytest.approx((11.4, 2.5, 31.2))
    assert (power.on, power.live, power.cut) == (True, True, CutReason.NEVER_ON)
    assert time == TimeReply(9, 1_021_234)
    assert code == 0x12345678
    assert refused is Refusal.HEARTBEAT
    assert f"0x{POWER_MAGIC:08X}" in PAGE
    assert f"0x{~code & 0xFFFFFFFF:08X}" in PAGE


def test_thresholds_on_the_page_are_those_of_the_driver():
    config = BoardConfig()
    for text in (
        f"no sample for {1e3 * config.imu_silence:.0f} ms",
        f"the same numbers for {1e3 * config.imu_frozen:.0f} ms",
        f"nothing heard for {1e3 * config.switch_silence:.0f} ms",
        f"two others changed {config.stuck_edges} times",
        f"more than {config.chatter_edges} changes in {config.chatter_window:g} s",
        f"quiet for {config.chatter_rest:.0f} s",
        f"nothing heard for {config.power_silence:g} s",
        f"outside {config.voltage_min:g}..{config.voltage_max:g} V",
        f"behind the switch {config.live_after_cut:g} s after a cut",
        f"Without any good frame for {config.link_silence:g} s",
        f"after {config.retry_first:g} s, then after waits that",
        f"double up to {config.retry_longest:g} s",
    ):
        assert text in " ".join(PAGE.split()), text
