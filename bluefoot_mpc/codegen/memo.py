"""Functions made once per process: to write down expressions takes longer than to load what was built."""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any

from bluefoot_mpc.codegen.config import CACHE_VARIABLE, SWITCH_VARIABLE

_KEPT = 64
_VARIABLES = (SWITCH_VARIABLE, CACHE_VARIABLE, "CC", "XDG_CACHE_HOME", "HOME")
"""What of the environment decides how functions are built."""

_memo: OrderedDict[Hashable, Any] = OrderedDict()


def made_once(make: Callable[[], Any], *content: Hashable) -> Any:
    """What ``make()`` gives, made anew only where content or environment are new to this process.

    A function may be shared: each of its buffers has memory of its own. The least
    recently used of more than 64 results is forgotten.

    Args:
        make: builds a function, or several; must depend on `content` alone.
        content: name and everything that shapes the result, equal where the result is.
    """
    key = (content, tuple(os.environ.get(name) for name in _VARIABLES))
    if key in _memo:
        _memo.move_to_end(key)
        return _memo[key]
    made = _memo[key] = make()
    if len(_memo) > _KEPT:
        _memo.popitem(last=False)
    return made
