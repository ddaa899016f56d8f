"""What a command hands back: an exit status, data for programs, a page for people."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import orjson
from rich.console import RenderableType

OK = 0
FAILED = 1
WRONG_USE = 2
INTERRUPTED = 130


@dataclass(frozen=True, kw_only=True, slots=True)
class Outcome:
    """Result of one command.

    Attributes:
        status: exit status of the process.
        data: what ``--json`` prints; numpy values and paths are fine.
        page: what a person sees without ``--json``, top to bottom.
        serve: what goes on after that, until Ctrl-C.
    """

    status: int = OK
    data: Mapping[str, Any] = field(default_factory=dict)
    page: tuple[RenderableType, ...] = ()
    serve: Callable[[], None] | None = None


def to_json(data: Mapping[str, Any]) -> str:
    """One JSON object on one line; a number that JSON does not have (NaN, infinity) becomes null."""
    return orjson.dumps(dict(data), default=_plain, option=orjson.OPT_SERIALIZE_NUMPY).decode()


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):  # one that is not contiguous
        return value.tolist()
    if isinstance(value, (set, frozenset)):
        return sorted(value)
    return str(value)
