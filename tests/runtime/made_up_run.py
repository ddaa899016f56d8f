"""Random but well-formed records: for tests of what carries and stores them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from bluefoot_mpc.runtime.data import CommandRecord, RunData
from bluefoot_mpc.runtime.log import RunLog
from bluefoot_mpc.types import (
    BodyState,
    CameraImage,
    GaitPhase,
    ImuBatch,
    JointCommand,
    LidarScan,
    Mode,
    MotionCommand,
    PostureReference,
    SafetyLevel,
    SafetyRequest,
    SensorFrame,
    Telemetry,
    TrunkPose,
    TruthSample,
)

PERIOD = 0.02
CONFIG: dict[str, Any] = {
    "run": {"scenario": "walk", "seed": 3, "robot": "sim", "controller": "cpg"},
    "model": {"name": "bluefoot", "legs": {"foot_radius": 0.008, "link_lengths": [0.065] * 4}},
}


def make_run(ticks: int, seed: int = 0) -> RunData:
    """A run of random numbers with NaN, empty batches, a scan, a picture and events in it."""
    rng = np.random.default_rng(seed)
    run = RunData(period=PERIOD, config=CONFIG, stop_reason="completed", real_time_factor=12.5)
    for k in range(ticks):
        time = k * PERIOD
        run.frames.append(frame(rng, time, samples=0 if k == 0 else 4, extras=k % 5 == 3))
        motion = MotionCommand(
            mode=Mode.WALK,
            velocity=np.array([0.06, 0.0]),
            trunk=TrunkPose(rpy=np.array([0.01, -0.02, 0.0])),
        )
        reasons = ("battery at 10.1 V",) if k % 7 == 1 else ()
        safety = SafetyRequest(level=SafetyLevel.SIT if reasons else SafetyLevel.NONE, reasons=reasons)
        joints = JointCommand(position=rng.normal(size=16), speed=np.zeros(16), torque_limit=np.ones(16))
        run.commands.append(CommandRecord(time=time, motion=motion, safety=safety, joints=joints))
        run.telemetry.append(telemetry(rng, time, motion))
        run.truth.append(truth(rng, time))
    return run


def frame(rng: np.random.Generator, time: float, samples: int, extras: bool) -> SensorFrame:
    magnetometer = rng.normal(size=(samples, 3))
    magnetometer[1:] = np.nan
    imu = ImuBatch(
        time=time + 0.005 * np.arange(samples),
        gyro=rng.normal(size=(samples, 3)),
        accel=rng.normal(size=(samples, 3)),
        magnetometer=magnetometer,
        valid=np.ones(samples, dtype=np.bool_),
    )
    distance = rng.uniform(0.1, 5.0, 7)
    distance[2] = np.nan
    scan = LidarScan(time=time, bearing=np.linspace(-1, 1, 7), distance=distance, valid=True)
    picture = CameraImage(time=time, pixels=rng.integers(0, 256, (4, 5, 3), dtype=np.uint8), valid=True)
    return SensorFrame(
        time=time,
        joint_position=rng.normal(size=16),
        joint_speed=rng.normal(size=16),
        joint_load=rng.normal(size=16),
        joint_temperature=rng.uniform(25, 45, 16),
        joint_time=np.full(16, time),
        joint_valid=rng.random(16) > 0.1,
        voltage=11.7,
        voltage_valid=True,
        imu=imu,
        contact=rng.random(4) > 0.5,
        contact_time=np.full(4, time),
        contact_valid=np.ones(4, dtype=np.bool_),
        lidar=scan if extras else None,
        camera=picture if extras else None,
    )


def telemetry(rng: np.random.Generator, time: float, motion: MotionCommand) -> Telemetry:
    quaternion = np.array([0.01, 0.02, 0.0, 1.0]) / np.sqrt(1.0005)
    estimate = BodyState(
        time=time,
        position=rng.normal(size=3),
        quaternion=quaternion,
        rpy=rng.normal(size=3),
        linear_velocity=rng.normal(size=3),
        angular_velocity=rng.normal(size=3),
        joint_position=rng.normal(size=16),
        joint_velocity=rng.normal(size=16),
        contact=rng.random(4) > 0.5,
        foot_position_in_base=rng.normal(size=(4, 3)),
        height=0.115,
    )
    swing = np.sin(2 * np.pi * (time / 0.46 + np.array([0.0, 0.5, 0.5, 0.0]))) > 0.2
    return Telemetry(
        time=time,
        mode=Mode.WALK,
        motion=motion,
        estimate=estimate,
        phase=GaitPhase(
            swing=swing,
            y1=rng.normal(size=4),
            y2=rng.normal(size=4),
            phase=rng.random(4),
            walking=True,
        ),
        reference=PostureReference(
            trunk_position=rng.normal(size=3),
            trunk_rpy=rng.normal(size=3),
            foot_position=rng.normal(size=(4, 3)),
            swing=swing,
        ),
        zmp=np.full(2, np.nan),
        events=("reflex of FL is null and void",) if rng.random() < 0.2 else (),
        tick_us=float(rng.gamma(20.0, 18.0)),
    )


def truth(rng: np.random.Generator, time: float) -> TruthSample:
    quaternion = np.array([0.012, 0.018, 0.001, 1.0])
    quaternion /= np.linalg.norm(quaternion)
    return TruthSample(
        time=time,
        q=np.concatenate([[0.06 * time, 0.001, 0.115], quaternion, rng.normal(size=16)]),
        v=np.concatenate([[0.06, 0, 0], rng.normal(size=19)]),
        com=np.array([0.06 * time, 0.0, 0.11]),
        momentum=np.concatenate([[0.06 * 1.9, 0.0, 0.0], 0.001 * rng.normal(size=3)]),
        foot_position=np.array([[1, 1, 0.0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]]) * 0.165 + 0.008,
        foot_height=np.abs(rng.normal(size=4)) * 0.01,
        foot_force=rng.normal(size=(4, 3)),
        motor_torque=rng.normal(size=16),
        duty=rng.uniform(-1, 1, 16),
        motor_temperature=rng.uniform(25, 45, 16),
        electrical_power=28.0,
        voltage=11.8,
        touching=(),
        external_force=np.zeros(3),
    )


def same(a: Any, b: Any) -> bool:
    """True when two values are equal in type, shape and every bit (all NaN are one)."""
    if isinstance(a, np.ndarray):
        alike = isinstance(b, np.ndarray) and (a.dtype, a.shape) == (b.dtype, b.shape)
        return alike and np.array_equal(a, b, equal_nan=a.dtype.kind == "f") and _same_signs(a, b)
    if hasattr(a, "__dataclass_fields__"):
        return type(a) is type(b) and all(same(getattr(a, n), getattr(b, n)) for n in a.__dataclass_fields__)
    if isinstance(a, float):
        return isinstance(b, float) and same(np.array([a]), np.array([b]))
    return type(a) is type(b) and bool(a == b)


def same_runs(a: RunData, b: RunData) -> bool:
    """True when all records of two runs are equal, the pictures that a log has packed included."""
    kept = [(frames_of(a), frames_of(b))]
    kept += [(a.records(topic), b.records(topic)) for topic in ("command", "telemetry", "truth")]
    return all(len(one) == len(other) and all(map(same, one, other)) for one, other in kept)


def frames_of(run: RunData) -> list[SensorFrame]:
    """A run's frames, with their pictures."""
    return [run.frame(index) for index in range(len(run.frames))] if isinstance(run, RunLog) else run.frames


def record_ticks(recorder: Any, run: RunData) -> None:
    """Record a run as the loop does."""
    for _ in iterate_ticks(recorder, run):
        pass


def iterate_ticks(recorder: Any, run: RunData) -> Iterator[int]:
    """Record a run, one tick per step of the iterator."""
    records = zip(run.frames, run.commands, run.telemetry, run.truth, strict=True)
    for k, (seen, given, thought, was) in enumerate(records):
        recorder.frame(seen)
        recorder.command(given.motion, given.joints, given.safety)
        recorder.telemetry(thought)
        recorder.truth(was)
        yield k


def _same_signs(a: np.ndarray[Any, Any], b: np.ndarray[Any, Any]) -> bool:
    if a.dtype.kind != "f":
        return True
    known = ~np.isnan(a)
    return bool(np.array_equal(np.signbit(a[known]), np.signbit(b[known])))
