"""The controllers by name; light, so that a command line can list them without loading any."""

from __future__ import annotations

CONTROLLERS = ("cpg", "mpc")
"""``cpg``: the paper's laws. ``mpc``: preview and whole-body control beside them."""
DEFAULT_CONTROLLER = "mpc"
"""What runs where nobody chooses."""
