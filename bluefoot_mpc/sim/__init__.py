"""Simulator: MuJoCo physics, servos, sensors and worlds behind the robot interface."""
