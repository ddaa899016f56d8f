"""Signed frames: forged, unsigned, old and repeated ones are refused."""

import hashlib

import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.station.framing import FrameReader
from bluefoot_mpc.io.station.signing import Signer, load_key, stamp_of

from .made_up import Peer

KEY = bytes(range(32))
WALL = 1_800_000_000.0


def signing_peer(key=KEY, wall=WALL):
    """pymavlink signs; its clock is `wall`."""
    peer = Peer()
    peer.mav.signing.secret_key = key
    peer.mav.signing.sign_outgoing = True
    peer.mav.signing.timestamp = stamp_of(wall)
    return peer


def received(data):
    (item,) = FrameReader().feed(data)
    return item


def test_pymavlinks_signature_is_accepted_once():
    signer, frame = Signer(KEY, lambda: WALL), signing_peer().manual(x=5)
    assert signer.accepts(received(frame))
    assert not signer.accepts(received(frame))


def test_pymavlink_accepts_our_signature():
    from pymavlink.dialects.v20 import common as mavlink

    from bluefoot_mpc.io.station.schedule import TokenBucket
    from bluefoot_mpc.io.station.writer import FrameWriter

    writer = FrameWriter(1, 1, TokenBucket(1000, 1000), Signer(KEY, lambda: WALL))
    peer = signing_peer()
    for _ in range(3):
        (message,) = peer.parse(writer.frame(mavlink.MAVLink_statustext_message(4, b"hello")))
        assert message.get_signed()
    assert peer.mav.signing.badsig_count == 0


@pytest.mark.parametrize("key", [bytes(32), KEY[::-1]])
def test_another_key_is_refused(key):
    assert not Signer(KEY, lambda: WALL).accepts(received(signing_peer(key).manual(x=5)))


def test_unsigned_frames_are_refused():
    assert not Signer(KEY, lambda: WALL).accepts(received(Peer().manual(x=5)))


def test_a_recording_is_refused_later():
    signer, peer = Signer(KEY, lambda: WALL), signing_peer()
    recording = [peer.manual(x=k) for k in range(300)]
    assert all(signer.accepts(received(frame)) for frame in recording)
    assert not any(signer.accepts(received(frame)) for frame in recording)


def test_a_recording_of_an_hour_ago_is_refused_after_a_restart():
    assert not Signer(KEY, lambda: WALL).accepts(received(signing_peer(wall=WALL - 3600.0).manual(x=5)))
    assert Signer(KEY, lambda: WALL).accepts(received(signing_peer(wall=WALL - 20.0).manual(x=5)))


def test_a_forged_stamp_locks_nobody_out():
    signer, peer = Signer(KEY, lambda: WALL), signing_peer()
    assert signer.accepts(received(peer.manual(x=1)))
    forger = signing_peer(bytes(32), wall=WALL + 1e6)
    assert not signer.accepts(received(forger.manual(x=2)))
    assert signer.accepts(received(peer.manual(x=3)))


def test_stamps_rise_whatever_the_wall_clock_does():
    times = iter([WALL, WALL + 10.0, WALL - 500.0, WALL - 500.0, WALL + 11.0])
    signer = Signer(KEY, lambda: next(times))
    stamps = [signer.stamp() for _ in range(4)]
    assert stamps == sorted(set(stamps))


def test_the_signature_is_the_one_of_the_guide():
    frame = signing_peer().manual(x=5)
    assert hashlib.sha256(KEY + frame[:-6]).digest()[:6] == frame[-6:]


def test_keys_are_raw_or_hexadecimal(tmp_path):
    raw, text = tmp_path / "raw", tmp_path / "text"
    raw.write_bytes(KEY)
    text.write_text(KEY.hex() + "\n")
    assert load_key(raw) == load_key(text) == KEY


@pytest.mark.parametrize("content", [b"", b"short", b"z" * 64, KEY + b"x"])
def test_other_files_are_no_keys(tmp_path, content):
    file = tmp_path / "key"
    file.write_bytes(content)
    with pytest.raises(ConfigurationError, match="head -c 32"):
        load_key(file)
    with pytest.raises(ConfigurationError, match="cannot read the key"):
        load_key(tmp_path / "none")
