"""Torque-speed envelope of the servos at their present voltage and temperature."""

from __future__ import annotations

from typing import Any


def torque_bounds(torque: Any, strength: Any, back_emf: Any, speed: Any) -> tuple[Any, Any]:
    """Lowest and highest torque (N·m) that the motors can make at the present joint speeds.

    The same law as `model.servo.torque_envelope`: the supply gives a torque, and the
    turning motor takes its back-EMF from it.

    Args:
        torque: N·m at standstill and nominal voltage.
        strength: present voltage over the nominal one, times what heat leaves.
        back_emf: N·m·s/rad.
        speed: rad/s.
    """
    lost = back_emf * speed
    return -strength * torque - lost, strength * torque - lost
