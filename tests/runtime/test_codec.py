"""Records survive the way through JSON bit for bit, whatever stands in them."""

from __future__ import annotations

import dataclasses
import math
import sys
import typing
from typing import Any

import numpy as np
import orjson
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from bluefoot_mpc import types
from bluefoot_mpc.exceptions import LogError
from bluefoot_mpc.runtime.codec import array_type, decode, encode, is_record, unwrap_optional
from bluefoot_mpc.runtime.data import CommandRecord
from tests.runtime.made_up_run import make_run, same

SHAPES = st.sampled_from([(0,), (1,), (4,), (16,), (4, 3), (0, 3), (2, 0), (0, 4, 3), (2, 3, 2)])
TEXT = st.sampled_from(["", "null", "[]", "Infinity", 'a "quoted" ü', "plain"])
RECORDS = (
    types.SensorFrame,
    CommandRecord,
    types.Telemetry,
    types.TruthSample,
    types.ContactSchedule,
    types.SafetyRequest,
)


def values_of(hint: Any) -> st.SearchStrategy[Any]:
    """Any value that a field of this type can have."""
    inner, optional = unwrap_optional(hint)
    if optional:
        return st.none() | values_of(inner)
    if is_record(inner):
        return records_of(inner)
    dtype = array_type(inner)
    if dtype is not None:
        return hnp.arrays(dtype, SHAPES)
    if typing.get_origin(inner) is tuple:
        return st.lists(TEXT, max_size=3).map(tuple)
    if inner is float:
        return st.floats()
    plain = {bool: st.booleans(), int: st.integers(0, 9), str: TEXT}
    return plain[inner] if inner in plain else st.sampled_from(list(inner))


def records_of(cls: Any) -> st.SearchStrategy[Any]:
    hints = typing.get_type_hints(cls)
    return st.builds(cls, **{f.name: values_of(hints[f.name]) for f in dataclasses.fields(cls)})


@pytest.mark.parametrize("cls", RECORDS, ids=lambda cls: cls.__name__)
@settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_any_record_comes_back_bit_for_bit(cls: type, data: st.DataObject) -> None:
    record = data.draw(records_of(cls))
    text = encode(record)
    assert same(decode(cls, text), record)
    orjson.loads(text)  # strict JSON: no NaN, no bare Infinity


def test_usual_records_come_back_bit_for_bit() -> None:
    run = make_run(12)
    for topic in ("frame", "command", "telemetry", "truth"):
        for record in run.records(topic):
            assert same(decode(type(record), encode(record)), record)


@pytest.mark.parametrize(
    "value", [math.nan, math.inf, -math.inf, -0.0, 5e-324, 0.1 + 0.2, sys.float_info.max]
)
def test_numbers_that_json_makes_hard(value: float) -> None:
    array = np.array([1.0, value, 3.0])
    command = types.JointCommand(position=array, speed=np.zeros(3), torque_limit=np.ones(3))
    assert same(decode(types.JointCommand, encode(command)), command)
    motion = types.MotionCommand(yaw_rate=value)
    assert same(decode(types.MotionCommand, encode(motion)), motion)


def test_arrays_that_are_not_contiguous() -> None:
    table = np.arange(12.0).reshape(3, 4)
    schedule = types.ContactSchedule(time=table[:, 1], stance=table.T > 5.0, footholds=table.T)
    back = decode(types.ContactSchedule, encode(schedule))
    assert same(back.footholds, np.ascontiguousarray(table.T))
    assert same(back.time, np.array([1.0, 5.0, 9.0]))


def test_pictures_travel_as_text() -> None:
    pixels = np.arange(60, dtype=np.uint8).reshape(4, 5, 3)
    picture = types.CameraImage(time=1.0, pixels=pixels, valid=True)
    assert len(encode(picture)) < 200
    assert same(decode(types.CameraImage, encode(picture)), picture)


def test_missing_fields_take_their_default_or_are_named() -> None:
    joints = make_run(1).commands[0].joints
    table = orjson.loads(encode(joints))
    del table["speed"]
    with pytest.raises(LogError, match=r"JointCommand: it lacks 'speed'"):
        decode(types.JointCommand, orjson.dumps(table))
    assert decode(types.SafetyRequest, b'{"level": 1}') == types.SafetyRequest(level=types.SafetyLevel.HOLD)


def test_fields_of_a_later_version_are_ignored() -> None:
    assert decode(types.SafetyRequest, b'{"level": 0, "colour": "red"}') == types.SafetyRequest()


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"{",
        b"[]",
        b"3",
        b'{"level": 9}',
        b'{"level": 0, "reasons": "no"}',
        b'{"level": 0, "reasons": [3]}',
    ],
)
def test_what_is_no_record_is_refused(text: bytes) -> None:
    with pytest.raises(LogError, match="not a record of type SafetyRequest"):
        decode(types.SafetyRequest, text)
