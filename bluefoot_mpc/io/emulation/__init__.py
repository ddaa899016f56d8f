"""Emulated devices: what sits at the other end of a link, byte by byte, without the hardware."""
