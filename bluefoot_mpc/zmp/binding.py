"""Calls of CasADi functions on numpy arrays in place: no copies, no conversions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.types import FloatArray


class Bound:
    """One dense function tied to arrays that it reads from and writes to.

    CasADi stores columns first: an (n, k) array here is a k x n matrix there.

    Args:
        function: dense function of vectors and matrices.
        inputs: C-contiguous arrays, in its order.
        outputs: the same for its results.

    Raises:
        ConfigurationError: an array does not fit.
    """

    def __init__(self, function: Any, inputs: Sequence[FloatArray], outputs: Sequence[FloatArray]) -> None:
        sizes = [function.nnz_in(k) for k in range(function.n_in())]
        sizes += [function.nnz_out(k) for k in range(function.n_out())]
        arrays = [*inputs, *outputs]
        if [array.size for array in arrays] != sizes or not all(a.flags.c_contiguous for a in arrays):
            raise ConfigurationError(f"arrays of {[a.size for a in arrays]} values do not fit {function}")
        self._arrays = arrays  # the buffer does not keep them alive
        self._buffer, call = function.buffer()
        for k, array in enumerate(inputs):
            self._buffer.set_arg(k, array.data)
        for k, array in enumerate(outputs):
            self._buffer.set_res(k, array.data)
        self.call: Callable[[], None] = call
        """Take the inputs, write the outputs."""
