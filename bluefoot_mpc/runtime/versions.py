"""Versions of what a run depends on, for its record."""

from __future__ import annotations

import functools
import platform
from importlib import metadata

PACKAGES: tuple[str, ...] = ("bluefoot-mpc", "mujoco", "pin", "casadi", "numpy", "scipy")


def installed_versions() -> dict[str, str]:
    """Version by name of the interpreter and of the installed packages that decide a run's numbers."""
    return dict(_versions())


@functools.cache
def _versions() -> tuple[tuple[str, str], ...]:
    found = [("python", platform.python_version())]
    for name in PACKAGES:
        try:
            found.append((name, metadata.version(name)))
        except metadata.PackageNotFoundError:
            continue
    return tuple(found)
