"""The robot itself: parameters, URDF, kinematics, dynamics, servos and power."""
