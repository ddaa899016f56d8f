"""The radio link to a ground station: MAVLink 2 over UDP or a serial port, both ends."""
