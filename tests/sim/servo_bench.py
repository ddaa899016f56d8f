"""Sixteen servos on a bench: hinges without gravity, each with a load of its own choosing."""

from dataclasses import replace

import mujoco
import numpy as np

from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.sim.servo import BankConfig, Plant, ServoBank
from bluefoot_mpc.types import JOINTS, N_JOINTS, JointCommand


def parameters(**changes):
    return replace(load_parameters().servo, **changes)


class Bench:
    def __init__(self, servo=None, *, voltage=12.0, resistance=0.0, inertia=1e-4, backlash=0.0, locked=False):
        servo = servo or parameters()
        joints = "".join(
            f'<body><joint name="{name}" axis="0 0 1" armature="{servo.armature}" frictionloss="1e-9"/>'
            f'<inertial pos="0 0 0" mass="1" diaginertia="{inertia} {inertia} {inertia}"/></body>'
            for name in JOINTS
        )
        motors = "".join(f'<motor joint="{name}"/>' for name in JOINTS)
        self.model = mujoco.MjModel.from_xml_string(
            f'<mujoco><option timestep="0.001" integrator="implicitfast" gravity="0 0 0" jacobian="dense"/>'
            f"<worldbody>{joints}</worldbody><actuator>{motors}</actuator></mujoco>"
        )
        self.data = mujoco.MjData(self.model)
        self.locked = locked
        self.bank = ServoBank(
            BankConfig(
                servo=servo,
                battery=replace(load_parameters().battery, resistance=resistance),
                gain=np.ones(N_JOINTS),
                friction_scale=np.ones(N_JOINTS),
                open_voltage=voltage,
                standby_current=0.05,
                backlash=backlash,
                load_friction_speed=0.5,
                period=0.001,
            ),
            Plant(
                position=self.data.qpos,
                speed=self.data.qvel,
                drive=self.data.ctrl,
                friction=self.model.dof_frictionloss,
                damping=self.model.dof_damping,
            ),
        )

    def command(self, position, speed=0.0, limit=1.0):
        self.bank.write(
            JointCommand(
                position=np.broadcast_to(np.asarray(position, dtype=float), N_JOINTS).copy(),
                speed=np.full(N_JOINTS, speed),
                torque_limit=np.full(N_JOINTS, limit),
            )
        )

    def run(self, seconds, load=0.0):
        """Angle and speed of the first servo, every millisecond."""
        self.data.qfrc_applied[:] = load
        steps = round(seconds * 1000)
        history = np.zeros((steps, 2))
        for k in range(steps):
            self.bank.advance()
            if not self.locked:
                mujoco.mj_step(self.model, self.data)
            history[k] = self.data.qpos[0], self.data.qvel[0]
        return history
