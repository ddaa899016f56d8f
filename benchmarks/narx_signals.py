"""The levelling law's signals of a simulated run, with the truth beside them: for `narx_prediction.py`."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.leveling.contact_force import contact_forces, specific_force
from bluefoot_mpc.leveling.servo_torque import ServoTorque
from bluefoot_mpc.leveling.signals import LevelingInputs, network_inputs, newest_rate, velocity
from bluefoot_mpc.leveling.trunk_dynamics import TrunkDynamics, disturbance, nominal_mass_matrix
from bluefoot_mpc.model.dynamics import Dynamics
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.runner import simulate
from bluefoot_mpc.tuning.leveling import UNLEVELLED_TROT
from bluefoot_mpc.types import N_JOINTS

TICK = 0.02
"""s, command period."""
STAND = 1.0
"""s before the first step."""
CYCLE = 50
"""Ticks of a cycle of that gait."""
LEVELLING = (
    "control.leveling.enabled=true", 'control.leveling.psi="zero"',
    f"control.leveling.schedule.start={STAND}",
    "control.leveling.schedule.off=10.0", "control.leveling.schedule.on=10.0",
)  # fmt: skip
LOAD = "reported load"
"""The law's source of motor torques: the duty that the servos report ..."""
DELAYS = {"goals, delay 0": 0, "goals, delay 1": 1, "goals, delay 2": 2}
"""... and what it would be without reports: their law on goals, so many command periods old."""


@dataclass
class Recording:
    """Signals of one run while it walks, n ticks at 50 Hz."""

    inputs: np.ndarray  # (n, 56) u_k
    target: np.ndarray  # (n, 22) ψ_k: what the predictors are given and have to predict
    targets: dict  # (n, 22) ψ_k by where the torque comes from
    mixed: dict  # (n, 22) ψ_k, with either velocities or torques true
    true: np.ndarray  # (n, 22) ψ_k of true velocities and mean motor torques
    model: np.ndarray  # (n, 22) Pinocchio's prediction for the coming period
    turn: np.ndarray  # (2, 22) Γ1 M̂⁻¹, roll and pitch


class MeanTorque:
    """Mean motor torque of every command period: looks at MuJoCo's memory before each physics step."""

    def __init__(self, back_emf):
        self.back_emf, self.samples, self.mj_step = back_emf, [], mujoco.mj_step

    def __enter__(self):
        mujoco.mj_step = self.step
        return self

    def __exit__(self, *_):
        mujoco.mj_step = self.mj_step

    def step(self, model, data):
        torque = data.ctrl[:N_JOINTS] - self.back_emf * data.qvel[6 : 6 + N_JOINTS]
        self.samples.append((data.time, torque))
        self.mj_step(model, data)

    def means(self, ticks, period):
        """(ticks, 16) N·m, over the period that ends at each frame; NaN for the first."""
        zero = max(i for i, (time, _) in enumerate(self.samples) if time == 0.0)
        torques = np.array([torque for _, torque in self.samples[zero:]])
        steps = round(period / (self.samples[zero + 1][0] - self.samples[zero][0]))
        found = np.full((ticks, N_JOINTS), np.nan)
        for tick in range(1, ticks):
            found[tick] = torques[(tick - 1) * steps : tick * steps].mean(axis=0)
        return found


class Law:
    """The levelling law's matrices and signals for one robot; what it sees of a tick."""

    def __init__(self, joints):
        self.robot = load_robot()
        self.dynamics = Dynamics(self.robot, rotor_inertia=True)
        self.matrix = TrunkDynamics.of(nominal_mass_matrix(self.dynamics, joints))
        height = self.robot.parameters.stance.trunk_height
        self.neutral = np.concatenate([[0.0, 0.0, height], self.robot.stance_joints])
        servo = self.robot.parameters.servo
        self.made = {name: ServoTorque(servo, delay) for name, delay in {LOAD: 1, **DELAYS}.items()}

    def tick(self, frame, estimate, goals):
        """Velocity, inputs, the model's prediction, and motor torque by where it comes from."""
        nominal = self.robot.parameters.servo.nominal_voltage
        signals = LevelingInputs(
            estimate=estimate, turn_rate=newest_rate(frame.imu, estimate.angular_velocity),
            tilt_reference=np.zeros(2), heading_error=float(estimate.rpy[2]), goals=goals,
            joint_load=frame.joint_load, specific_force=specific_force(frame.imu),
            voltage=frame.voltage if frame.voltage_valid else nominal, walking=True,
        )  # fmt: skip
        speed, torques = velocity(signals), {}
        for name, made in self.made.items():
            load = frame.joint_load if name == LOAD else np.full(N_JOINTS, np.nan)
            torques[name] = made.torque(estimate.joint_position, load, signals.voltage, TICK)
            made.send(goals)
        rotation = rotation_from_quaternion(estimate.quaternion)
        force = contact_forces(self.dynamics.mass, rotation @ signals.specific_force, estimate.contact)
        inputs = network_inputs(signals, rotation, self.neutral, speed, force)
        q = np.concatenate([estimate.position, estimate.quaternion, estimate.joint_position])
        jacobians = self.dynamics.foot_jacobians(q).reshape(-1, 22)
        model = force.ravel() @ jacobians - self.dynamics.bias(q, speed)
        return speed, inputs, model, torques


def record(args, seed):
    """One run, reduced to the law's signals."""
    levelling = LEVELLING if args.levelling else ()
    options = RunOptions(
        speed=1e-3 * args.speed, seed=seed, controller="cpg", duration=STAND + args.seconds + 1.5,
        randomize=args.randomize,
        overrides=(f"scenario.stand_time={STAND}", *UNLEVELLED_TROT, *levelling, *args.set),
    )  # fmt: skip
    with MeanTorque(load_robot().parameters.servo.back_emf) as mean:
        data = simulate("walk", options).data
    if data.stop_reason != "completed":
        raise SystemExit(f"seed {seed}: {data.stop_reason}")
    torques, walks = mean.means(len(data.telemetry), data.period), STAND + 2.0
    joints = [t.estimate.joint_position for t in data.telemetry if t.time > walks][: 2 * CYCLE]
    law = Law(np.array(joints))
    rows = {key: [] for key in ("inputs", "model", "true", "velocities", "torques", LOAD, *DELAYS)}
    before = true_before = None
    for tick, telemetry in enumerate(data.telemetry):
        frame, goals = data.frames[tick], data.commands[tick].joints.position
        speed, inputs, model, made = law.tick(frame, telemetry.estimate, goals)
        true = data.truth[tick].v
        if frame.time >= STAND:
            known = (law.matrix.mass, true_before, true)
            seen = (law.matrix.mass, before, speed)
            for name, torque in made.items():
                rows[name].append(disturbance(*seen, torque, data.period))
            rows["true"].append(disturbance(*known, torques[tick], data.period))
            rows["velocities"].append(disturbance(*known, made[args.target], data.period))
            rows["torques"].append(disturbance(*seen, torques[tick], data.period))
            rows["inputs"].append(inputs)
            rows["model"].append(model)
        before, true_before = speed, true
    arrays = {key: np.array(value) for key, value in rows.items()}
    return Recording(
        inputs=arrays["inputs"], target=arrays[args.target], true=arrays["true"],
        targets={name: arrays[name] for name in (LOAD, *DELAYS)},
        mixed={name: arrays[name] for name in ("velocities", "torques")},
        model=arrays["model"], turn=law.matrix.from_force[:2],
    )  # fmt: skip
