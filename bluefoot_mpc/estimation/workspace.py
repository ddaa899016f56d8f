"""Calls of CasADi functions without copies or conversions: a few microseconds each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np

from bluefoot_mpc.codegen import compiled
from bluefoot_mpc.types import FloatArray


class Workspace:
    """Arrays that one function reads from and writes to in place.

    CasADi stores columns first, numpy rows first: a matrix must enter and
    leave the function transposed. Every result is written anew on each call, so
    copy what must last.

    Args:
        function: dense function of vectors and matrices.
    """

    def __init__(self, function: Any) -> None:
        self._function = function
        self._buffer, self._call = function.buffer()
        self.inputs = tuple(_array(function.size_in(k)) for k in range(function.n_in()))
        self.outputs = tuple(_array(function.size_out(k)) for k in range(function.n_out()))
        for k, array in enumerate(self.inputs):
            self._buffer.set_arg(k, array.data)
        for k, array in enumerate(self.outputs):
            self._buffer.set_res(k, array.data)
        self.call = self._call
        """Take the inputs, write the outputs."""


def _array(size: tuple[int, int]) -> FloatArray:
    rows, columns = size
    return np.zeros(rows) if columns == 1 else np.zeros((columns, rows))


def compile_function(name: str, inputs: Mapping[str, Any], outputs: Mapping[str, Any]) -> Any:
    """A dense CasADi function as machine code where it can be built, with repeated parts computed once.

    Args:
        name: of the function.
        inputs: names and symbols.
        outputs: names and expressions.
    """
    function = ca.Function(
        name, list(inputs.values()), [ca.densify(value) for value in outputs.values()],
        list(inputs), list(outputs), {"cse": True},
    )  # fmt: skip
    return compiled(function)
