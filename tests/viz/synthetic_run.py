"""A made-up trot that looks like a run, without a simulator: for tests of pictures."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.geometry import quaternion_from_rpy, rotation_from_rpy
from bluefoot_mpc.model.legs import inverse
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import CommandRecord, RunData
from bluefoot_mpc.types import (
    BodyState,
    GaitPhase,
    ImuBatch,
    JointCommand,
    Mode,
    MotionCommand,
    PostureReference,
    SafetyRequest,
    SensorFrame,
    Telemetry,
    TruthSample,
)

PERIOD = 0.02
CYCLE = 0.6
DUTY = 0.62
LAG = np.array([0.0, 0.5, 0.5, 0.0])
MASS = 1.9


def make_run(robot: RobotModel, *, duration: float = 4.0, truth: bool = True, seed: int = 0) -> RunData:
    """A straight trot at 60 mm/s, kinematic, with wobble and noise."""
    rng = np.random.default_rng(seed)
    run = RunData(period=PERIOD, config=_config(seed), real_time_factor=14.2)
    stance = robot.parameters.stance
    for index in range(round(duration / PERIOD)):
        time = index * PERIOD
        walking = time > 1.0
        speed = 0.06 * min(1.0, max(0.0, time - 1.0))
        x = 0.06 * max(0.0, time - 1.5)
        phase = ((time - 1.0) / CYCLE + LAG) % 1.0
        swing = walking & (phase < 1.0 - DUTY)
        share = np.clip(phase / (1.0 - DUTY), 0.0, 1.0)
        offset = np.where(swing, share - 0.5, 0.5 - (phase - (1 - DUTY)) / DUTY) * 0.06 * CYCLE * DUTY
        lift = np.where(swing, 0.018 * np.sin(np.pi * share), 0.0)
        wobble = 0.008 * np.sin(4.0 * np.pi * time / CYCLE)
        rpy = np.array([wobble, 0.6 * wobble + 0.002, 0.01 * np.sin(0.4 * time)]) * walking
        height = stance.trunk_height + 0.001 * np.sin(4.0 * np.pi * time / CYCLE) * walking
        feet = stance.foot_position + np.column_stack([offset * walking, np.zeros(4), lift])
        position = np.array([x, 0.004 * np.sin(2.0 * np.pi * time / CYCLE) * walking, height])
        rotation = rotation_from_rpy(rpy)
        feet_world = feet + np.array([x, 0.0, 0.0])
        feet_in_base = (feet_world - position) @ rotation
        joints = inverse(robot.geometry, feet_in_base, np.full(4, np.radians(-99.0))).joints
        quaternion = quaternion_from_rpy(rpy)
        contact = ~swing
        mode = Mode.WALK if walking else Mode.STAND
        motion = MotionCommand(mode=mode, velocity=np.array([0.06 if walking else 0.0, 0.0]))
        velocity = np.array([speed, 0.02 * np.cos(2.0 * np.pi * time / CYCLE) * walking, 0.0])
        estimate = BodyState(
            time=time,
            position=position + rng.normal(0, 0.0008, 3),
            quaternion=quaternion_from_rpy(rpy + rng.normal(0, 0.001, 3)),
            rpy=rpy + rng.normal(0, 0.001, 3),
            linear_velocity=velocity + rng.normal(0, 0.004, 3),
            angular_velocity=rng.normal(0, 0.02, 3),
            joint_position=joints,
            joint_velocity=np.zeros(16),
            contact=contact,
            foot_position_in_base=feet_in_base,
            height=height,
        )
        load = (
            0.35 + 0.25 * np.sin(2.0 * np.pi * (time / CYCLE + np.repeat(LAG, 4))) + rng.normal(0, 0.03, 16)
        )
        load = load * np.tile([0.15, 0.8, -0.9, 0.3], 4)
        run.frames.append(_frame(time, joints, load, contact, rng))
        command = JointCommand(position=joints, speed=np.zeros(16), torque_limit=np.ones(16))
        run.commands.append(CommandRecord(time=time, motion=motion, safety=SafetyRequest(), joints=command))
        events = ("mode off -> stand",) if index == 0 else ("mode stand -> walk",) if index == 51 else ()
        if 120 <= index < 124:
            events = (*events, "FL knee cut at -90.0 deg, 0.4 deg beyond its limit")
        run.telemetry.append(
            Telemetry(
                time=time,
                mode=mode,
                motion=motion,
                estimate=estimate,
                phase=GaitPhase(
                    swing=swing,
                    y1=np.cos(2 * np.pi * phase),
                    y2=np.sin(2 * np.pi * phase),
                    phase=phase,
                    walking=walking,
                ),
                reference=PostureReference(
                    trunk_position=np.array(
                        [0.0, 0.004 * np.sin(2.0 * np.pi * time / CYCLE) * walking, height]
                    ),
                    trunk_rpy=np.zeros(3),
                    foot_position=feet,
                    swing=swing,
                ),
                zmp=np.array([0.0, 0.006 * np.sin(2.0 * np.pi * time / CYCLE)])
                if walking
                else np.full(2, np.nan),
                events=events,
                tick_us=float(rng.gamma(20.0, 18.0)),
            )
        )
        if truth:
            run.truth.append(
                _truth(time, position, quaternion, joints, velocity, feet_world, lift, contact, load, rng)
            )
    return run


def make_summary(**over: object) -> dict[str, object]:
    """A summary as a good 60 mm/s trot gives it."""
    summary: dict[str, object] = {
        "scenario": "walk",
        "seed": 0,
        "robot": "sim",
        "controller": "cpg",
        "gait": "trot",
        "duration_s": 60.0,
        "fell": False,
        "success": True,
        "stop_reason": "completed",
        "distance_m": 3.48,
        "speed_ref_mps": 0.06,
        "speed_mps": 0.0597,
        "lateral_drift_m": 0.012,
        "yaw_drift_deg": -0.4,
        "roll_rms_deg": 0.31,
        "pitch_rms_deg": 0.42,
        "roll_peak_deg": 0.9,
        "pitch_peak_deg": 1.2,
        "attitude_error_rms_deg": 0.08,
        "zmp_inside_fraction": None,
        "zmp_margin_min_m": None,
        "zmp_plan_margin_min_m": None,
        "swing_clearance_median_m": 0.0104,
        "torque_peak_nm": 1.21,
        "torque_rms_nm": 0.38,
        "servo_temp_max_c": 41.2,
        "energy_j": 1830.0,
        "cost_of_transport": 28.2,
        "qp_failures": 0,
        "deadline_misses": 0,
        "tick_us": {"p50": 360.0, "p99": 520.0, "max": 812.0},
        "real_time_factor": 14.2,
        "config_sha256": "0123456789abcdef" * 4,
        "versions": {"bluefoot_mpc": "0.1.0", "mujoco": "4.0.0"},
        "figures": {"lift_off_lag_FR": 0.497},
    }
    return {**summary, **over}


def _config(seed: int) -> dict[str, object]:
    return {
        "run": {"scenario": "walk", "seed": seed, "robot": "sim", "controller": "cpg"},
        "walk": {"gait": "trot", "speed": 0.06},
        "control": {"zmp": {"gain": 3.0, "enabled": True}},
    }


def _frame(time, joints, load, contact, rng) -> SensorFrame:
    n = 4
    imu = ImuBatch(
        time=time + np.arange(n) * 0.005,
        gyro=rng.normal(0, 0.01, (n, 3)),
        accel=np.tile([0.0, 0.0, 9.8], (n, 1)),
        magnetometer=np.full((n, 3), np.nan),
        valid=np.ones(n, dtype=bool),
    )
    return SensorFrame(
        time=time,
        joint_position=joints,
        joint_speed=np.zeros(16),
        joint_load=load,
        joint_temperature=30.0
        + 9.0 * (1 - np.exp(-time / 30.0)) * np.tile([0.3, 1.0, 1.1, 0.5], 4)
        + np.arange(16) * 0.05,
        joint_time=np.full(16, time),
        joint_valid=np.ones(16, dtype=bool),
        voltage=11.8,
        voltage_valid=True,
        imu=imu,
        contact=contact,
        contact_time=np.full(4, time),
        contact_valid=np.ones(4, dtype=bool),
    )


def _truth(  # noqa: PLR0917
    time, position, quaternion, joints, velocity, feet, lift, contact, load, rng
) -> TruthSample:
    com = position + np.array([0.002, 0.0, -0.01])
    weight = MASS * 9.80665 * contact / max(1, contact.sum())
    push = np.array([0.0, 20.0, 0.0]) if 2.5 <= time < 2.6 else np.zeros(3)
    return TruthSample(
        time=time,
        q=np.concatenate([position, quaternion, joints]),
        v=np.concatenate([velocity, rng.normal(0, 0.02, 3), np.zeros(16)]),
        com=com,
        momentum=np.concatenate([MASS * velocity, 0.002 * rng.normal(0, 1.0, 3)]),
        foot_position=feet + np.array([0.0, 0.0, 0.008]),
        foot_height=lift,
        foot_force=np.column_stack([np.zeros((4, 2)), weight]),
        motor_torque=1.5 * load,
        duty=load,
        motor_temperature=np.full(16, 33.0),
        electrical_power=28.0 + 4.0 * rng.normal(),
        voltage=11.8,
        touching=(),
        external_force=push,
    )
