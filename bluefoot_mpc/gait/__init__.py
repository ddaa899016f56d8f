"""Gait: pattern generator, couplings, reflex, virtual robot, footholds, schedule."""
