"""The robot of sixteen servos."""
