"""Pictures in a log: bit for bit, shown by viewers, unpacked one at a time."""

from __future__ import annotations

import base64
import tracemalloc
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import orjson
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from mcap.reader import make_reader

from bluefoot_mpc.exceptions import LogError
from bluefoot_mpc.runtime.codec import encode
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.runtime.log import read_log
from bluefoot_mpc.runtime.packed_pictures import SCHEMA, can_be_packed, pack, unpack
from bluefoot_mpc.runtime.recorder import RECORD_CLASSES, Recorder
from bluefoot_mpc.runtime.replay import rethink
from bluefoot_mpc.types import CameraImage, JointCommand, MotionCommand, SafetyRequest, SensorFrame
from tests.runtime.made_up_run import CONFIG, PERIOD, frame, make_run, record_ticks, same

RNG = np.random.default_rng(5)
SIZES = st.tuples(st.integers(1, 40), st.integers(1, 40), st.just(3))


@settings(deadline=None, max_examples=40)
@given(arrays(np.uint8, SIZES), st.floats(0.0, 1e6), st.floats(0.0, 1e6), st.booleans())
def test_a_picture_comes_back_bit_for_bit(pixels, time, at, valid):
    image = CameraImage(time=time, pixels=pixels, valid=valid)
    packed = unpack(pack(image, at))
    assert packed.frame == at
    assert same(packed.image(), image)


def test_other_pictures_stay_in_their_frames(tmp_path: Path) -> None:
    for shape in ((4, 5), (4, 5, 4), (0, 5, 3)):
        image = CameraImage(time=0.0, pixels=np.zeros(shape, dtype=np.uint8), valid=True)
        assert not can_be_packed(image)
        path = tmp_path / "log.mcap"
        with Recorder(path, CONFIG, PERIOD) as recorder:
            recorder.frame(replace(frame(RNG, 0.0, 4, False), camera=image))
        log = read_log(path)
        assert not log.packed
        assert same(log.frame(0).camera, image)


@pytest.mark.parametrize("time", [np.nan, np.inf, -np.inf, 1e300])
def test_pictures_of_no_time_stay_in_their_frames(tmp_path: Path, time: float) -> None:
    image = CameraImage(time=time, pixels=RNG.integers(0, 256, (4, 5, 3), dtype=np.uint8), valid=True)
    assert not can_be_packed(image)
    with Recorder(tmp_path / "log.mcap", CONFIG, PERIOD) as recorder:
        recorder.frame(replace(frame(RNG, 0.0, 4, False), camera=image))
        recorder.frame(frame(RNG, 0.02, 4, False))
    log = read_log(tmp_path / "log.mcap", strict=True)
    assert len(log.frames) == 2
    assert same(log.frame(0).camera, image)


@pytest.mark.parametrize(
    "pixels",
    [None, [[1, 2, 3]], "none", np.full((4, 5, 3), 0.5), np.full((4, 5, 3), 777, np.uint16)],
    ids=["none", "list", "text", "float", "uint16"],
)
def test_of_what_is_no_picture_the_log_keeps_that_one_came(tmp_path: Path, pixels: Any) -> None:
    image = CameraImage(time=1.5, pixels=pixels, valid=True)
    with Recorder(tmp_path / "log.mcap", CONFIG, PERIOD) as recorder:
        recorder.frame(replace(frame(RNG, 0.0, 4, False), camera=image))
        recorder.frame(frame(RNG, 0.02, 4, False))
    log = read_log(tmp_path / "log.mcap", strict=True)
    assert len(log.frames) == 2
    kept = log.frame(0).camera
    assert kept is not None
    assert (kept.time, kept.valid, kept.pixels.shape) == (1.5, False, (0, 0, 3))


def test_viewers_get_a_png_and_the_time_of_exposure(tmp_path: Path) -> None:
    pixels = RNG.integers(0, 256, (6, 8, 3), dtype=np.uint8)
    with Recorder(tmp_path / "log.mcap", CONFIG) as recorder:
        image = CameraImage(time=1.25, pixels=pixels, valid=True)
        recorder.frame(replace(frame(RNG, 1.36, 4, False), camera=image))
    with (tmp_path / "log.mcap").open("rb") as stream:
        found = [
            (schema.name, orjson.loads(message.data))
            for schema, channel, message in make_reader(stream).iter_messages()
            if channel.topic == "/camera"
        ]
    ((name, message),) = found
    assert name == "foxglove.CompressedImage"
    assert set(message) == set(SCHEMA["properties"])
    assert message["timestamp"] == {"sec": 1, "nsec": 250_000_000}
    drawn = cv2.imdecode(np.frombuffer(base64.b64decode(message["data"]), np.uint8), cv2.IMREAD_COLOR)
    assert message["format"] == "png"
    np.testing.assert_array_equal(drawn[:, :, ::-1], pixels)


def test_logs_of_earlier_versions_have_pictures_in_their_frames(tmp_path: Path) -> None:
    run = make_run(20)
    with Recorder(tmp_path / "log.mcap", CONFIG, PERIOD) as recorder:
        for record in run.frames:
            # As it was written before pictures had a topic.
            recorder._put("/frame", record.time, encode(record))
    log = read_log(tmp_path / "log.mcap")
    assert any(record.camera is not None for record in log.frames)
    assert all(same(log.frame(k), record) for k, record in enumerate(run.frames))


class Seeing:
    """A controller whose commands depend on every pixel."""

    def __init__(self) -> None:
        self.sum = 0.0

    def step(self, frame: SensorFrame, motion: MotionCommand, safety: SafetyRequest) -> JointCommand:
        if frame.camera is not None:
            self.sum += float(np.vdot(frame.camera.pixels, np.arange(frame.camera.pixels.size)))
        return JointCommand(position=np.full(16, self.sum), speed=np.zeros(16), torque_limit=np.ones(16))


def seen_run(count: int) -> RunData:
    run, controller = make_run(count), Seeing()
    for k, record in enumerate(run.commands):
        joints = controller.step(run.frames[k], record.motion, record.safety)
        run.commands[k] = replace(record, joints=joints)
    return run


def test_rethinking_sees_the_pictures(tmp_path: Path) -> None:
    run = seen_run(60)
    with Recorder(tmp_path / "log.mcap", CONFIG, PERIOD) as recorder:
        record_ticks(recorder, run)
    log = read_log(tmp_path / "log.mcap")
    assert log.packed
    report = rethink(log, lambda: Seeing().step)
    assert report.equal
    assert report.ticks == 60
    # And it would notice if one pixel were another.
    key, packed = next(iter(log.packed.items()))
    changed = packed.image()
    changed.pixels[0, -1, 0] ^= 1
    log.packed[key] = unpack(pack(changed, key))
    assert not rethink(log, lambda: Seeing().step).equal


def test_a_log_keeps_its_pictures_packed(tmp_path: Path) -> None:
    gray = np.full((480, 640, 3), 90, dtype=np.uint8)
    with Recorder(tmp_path / "log.mcap", CONFIG, PERIOD) as recorder:
        for k in range(40):
            image = CameraImage(time=0.1 * k, pixels=gray, valid=True)
            recorder.frame(replace(frame(RNG, 0.1 * k, 4, False), camera=image))
    tracemalloc.start()
    log = read_log(tmp_path / "log.mcap")
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(log.packed) == 40
    assert most < 0.3 * 40 * gray.nbytes
    np.testing.assert_array_equal(log.frame(39).camera.pixels, gray)


def test_a_report_gets_a_few_pictures(tmp_path: Path) -> None:
    run = make_run(120)
    with Recorder(tmp_path / "log.mcap", CONFIG, PERIOD) as recorder:
        record_ticks(recorder, run)
    log = read_log(tmp_path / "log.mcap")
    log.look_through()
    for record, telemetry in zip(run.frames, run.telemetry, strict=True):
        run.keep_picture(record, telemetry)
    assert len(log.pictures) == len(run.pictures) > 0


@pytest.mark.parametrize("data", [b"[]", b"{}", b'{"frame": 0, "time": 0, "valid": true, "data": "?"}'])
def test_damaged_messages_are_refused(data):
    with pytest.raises(LogError):
        unpack(data)


def test_a_damaged_picture_is_refused():
    text = base64.b64encode(b"no picture").decode()
    message = orjson.dumps({"frame": 0.0, "time": 2.5, "valid": True, "data": text})
    with pytest.raises(LogError, match=r"2\.500 s"):
        unpack(message).image()


def test_pictures_are_no_record_class():
    assert "/camera" not in RECORD_CLASSES
