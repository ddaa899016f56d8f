"""Logs read back into memory."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from bluefoot_mpc.runtime.data import RunData


@dataclass(kw_only=True, slots=True)
class RunLog(RunData):
    """A run as read from a file.

    Attributes:
        path: the file.
        truncated: True when the file ends before its end mark: the writer was
            killed, or the copy is incomplete; the lists hold what is readable.
    """

    path: Path
    truncated: bool = False
