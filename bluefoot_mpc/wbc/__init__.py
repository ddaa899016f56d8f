"""Whole-body control: joint accelerations, contact forces and torques from tasks and constraints."""
