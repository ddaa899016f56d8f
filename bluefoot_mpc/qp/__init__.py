"""Quadratic programs: problem, solution, and solvers by name."""
