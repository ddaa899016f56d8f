"""Wheeled robots and legs on paper: constraints, mobility, ready robots, balance, gait diagrams."""
