"""Calls of CasADi functions on numpy arrays without copies or conversions."""

from __future__ import annotations

from typing import Any

import casadi as ca

from bluefoot_mpc.types import FloatArray


class Buffers:
    """A CasADi function on arrays that it reads and writes in place.

    `call` is only good as long as this object lives.

    Args:
        function: dense function.
        inputs: one array per input, in its order; columns first where it is a matrix.
        outputs: likewise; contiguous parts of larger arrays will do.
    """

    def __init__(self, function: ca.Function, inputs: list[FloatArray], outputs: list[FloatArray]) -> None:
        self._kept = (function, inputs, outputs)
        pair: Any = function.buffer()  # CasADi's annotations ask for the size that a memoryview carries
        self._buffer, self.call = pair
        for index, array in enumerate(inputs):
            self._buffer.set_arg(index, array.reshape(-1).data)
        for index, array in enumerate(outputs):
            self._buffer.set_res(index, array.reshape(-1).data)
