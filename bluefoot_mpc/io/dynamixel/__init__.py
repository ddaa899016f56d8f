"""Servos on a half-duplex bus: ROBOTIS' Protocol 1.0 and the AX-12A, from bytes to the cycle of sixteen."""
