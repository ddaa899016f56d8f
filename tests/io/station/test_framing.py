"""Frames out of a stream of bytes, good ones and bad ones."""

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bluefoot_mpc.io.station.framing import FrameReader

from .made_up import Peer


def stream(count=20):
    peer = Peer()
    return [peer.manual(x=10 * k, r=-k) if k % 3 else peer.heartbeat() for k in range(count)]


def test_frames_come_out_whole_and_in_order():
    frames = stream()
    found = FrameReader().feed(b"".join(frames))
    assert [item.frame for item in found] == frames
    assert [item.sequence for item in found] == list(range(20))
    assert {(item.system, item.component, item.signed) for item in found} == {(255, 190, False)}


@settings(max_examples=30, deadline=None)
@given(cuts=st.lists(st.integers(0, 500), max_size=12))
def test_it_does_not_matter_where_the_stream_is_cut(cuts):
    data = b"".join(stream())
    edges = sorted({0, len(data), *(cut for cut in cuts if cut < len(data))})
    reader = FrameReader()
    found = [item for a, b in itertools.pairwise(edges) for item in reader.feed(data[a:b])]
    assert [item.sequence for item in found] == list(range(20))


@settings(max_examples=50, deadline=None)
@given(garbage=st.binary(max_size=300))
def test_garbage_between_frames_costs_no_frame_for_long(garbage):
    peer = Peer()
    reader = FrameReader()
    found = reader.feed(peer.manual(x=1) + garbage)
    # What the garbage pretended to begin may be waited for; 300 bytes end every wait.
    for k in range(20):
        found += reader.feed(peer.manual(x=2 + k))
    values = [item.message.x for item in found if item.message.get_type() == "MANUAL_CONTROL"]
    assert values[0] == 1
    assert values[-1] == 21


def test_a_frame_inside_a_broken_one_is_found():
    peer = Peer()
    good = peer.manual(x=5)
    # A head that promises 30 bytes of MANUAL_CONTROL, and then the true frame.
    head = bytes([0xFD, 30, 0, 0, 0, 255, 190, 69, 0, 0])
    reader = FrameReader()
    found = reader.feed(head + good + peer.heartbeat())
    assert next(item.frame for item in found) == good
    assert reader.bad == 1


def test_a_burst_of_start_bytes_is_not_slow_work():
    reader = FrameReader()
    assert reader.feed(b"\xfd" * 200_000) == []
    assert reader.skipped > 190_000
    assert len(reader.feed(stream(1)[0] * 1 + b"\x00" * 300)) == 1


def test_no_single_corrupt_byte_goes_unnoticed():
    frame = Peer().manual(x=700, y=-300, r=20)
    for place in range(len(frame)):
        for change in (0x01, 0x80, 0xFF):
            broken = bytearray(frame)
            broken[place] ^= change
            assert FrameReader().feed(bytes(broken) + bytes(300)) == [], place


def test_random_bytes_are_no_frames():
    rng = np.random.default_rng(1)
    reader = FrameReader()
    assert not any(reader.feed(rng.bytes(1000)) for _ in range(300))
