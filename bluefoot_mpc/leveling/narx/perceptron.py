"""Two hidden layers of symmetric sigmoids and a linear output, with gradients, in memory of its own.

The symmetric sigmoid is the bipolar one, tanh(a) = (1 - e^(-2a)) / (1 + e^(-2a)).
Biases are weights of an input that is always 1. The gradient is that of
½|output - target|² for the inputs as they are: fed-back outputs among them count
as given numbers, nothing is propagated back through time.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from bluefoot_mpc.types import FloatArray


class _Layer:
    """One layer: views on shared memory, and buffers of its own."""

    __slots__ = ("back", "delta", "delta_column", "input_row", "inputs", "update", "weights")

    def __init__(self, weights: FloatArray) -> None:
        rows, columns = weights.shape
        self.weights = weights
        self.inputs = np.zeros(columns)
        self.inputs[-1] = 1.0
        self.input_row = self.inputs[None, :]
        self.back = np.zeros(columns)
        self.delta = np.zeros(rows)
        self.delta_column = self.delta[:, None]
        self.update = np.zeros((rows, columns))


class Perceptron:
    """Network of layers; forward and backward passes allocate nothing.

    Attributes:
        weights: (n,) all weights; `layers` are views on it.
        layers: (rows, columns + 1) per layer, row = neuron, last column = bias.
        inputs: (sizes[0],) to be written before `forward`.
        output: (sizes[-1],) of the last `forward`.

    Args:
        sizes: inputs, neurons of each hidden layer, outputs.
    """

    def __init__(self, sizes: tuple[int, ...]) -> None:
        shapes = [(after, before + 1) for before, after in pairwise(sizes)]
        ends = np.cumsum([rows * columns for rows, columns in shapes])
        self.weights = np.zeros(int(ends[-1]))
        parts = np.split(self.weights, ends[:-1])
        self.layers = tuple(part.reshape(shape) for part, shape in zip(parts, shapes, strict=True))
        self._layers = tuple(_Layer(view) for view in self.layers)
        self.inputs = self._layers[0].inputs[:-1]
        self.output = np.zeros(sizes[-1])
        hidden = tuple(layer.inputs[:-1] for layer in self._layers[1:])
        self._outputs = (*hidden, self.output)
        self._slopes = tuple(np.zeros_like(values) for values in hidden)

    def forward(self) -> FloatArray:
        """Output for `inputs`, (sizes[-1],): memory that the next call writes over."""
        for layer, output in zip(self._layers, self._outputs, strict=True):
            np.dot(layer.weights, layer.inputs, out=output)
            if output is not self.output:
                np.tanh(output, out=output)
        return self.output

    def backward(self, error: FloatArray) -> float:
        """Prepare the gradient of ½|output - target|² at the last `forward`; returns its norm.

        Args:
            error: (sizes[-1],) output - target.
        """
        layers, square = self._layers, 0.0
        layers[-1].delta[:] = error
        for index in range(len(layers) - 1, -1, -1):
            layer = layers[index]
            # The norm of an outer product is the product of the norms.
            square += float(np.dot(layer.delta, layer.delta)) * float(np.dot(layer.inputs, layer.inputs))
            if index:
                before, output, slope = layers[index - 1], self._outputs[index - 1], self._slopes[index - 1]
                np.dot(layer.delta, layer.weights, out=layer.back)
                np.multiply(output, output, out=slope)
                np.subtract(1.0, slope, out=slope)
                np.multiply(layer.back[:-1], slope, out=before.delta)
        return math.sqrt(square)

    def descend(self, step: float) -> None:
        """Move the weights by -step times the gradient that `backward` prepared, which this uses up."""
        for layer in self._layers:
            np.multiply(layer.delta, step, out=layer.delta)
            # A matrix product of a column and a row is three times faster than a broadcast one.
            np.dot(layer.delta_column, layer.input_row, out=layer.update)
            np.subtract(layer.weights, layer.update, out=layer.weights)

    def gradient(self) -> FloatArray:
        """A new (n,) array: the gradient that `backward` prepared, in the order of `weights`."""
        return np.concatenate([np.outer(layer.delta, layer.inputs).ravel() for layer in self._layers])

    def norm(self) -> float:
        """Euclidean norm of all weights."""
        return math.sqrt(float(np.dot(self.weights, self.weights)))


def random_weights(sizes: tuple[int, ...], scale: float, generator: np.random.Generator) -> FloatArray:
    """First weights: normal, standard deviation scale / √(inputs of the neuron), in `Perceptron`'s order.

    Args:
        sizes: inputs, neurons of each hidden layer, outputs.
        scale: 1; with scaled inputs about 1 keeps the sigmoids in their bend.
        generator: source of randomness.
    """
    parts = [
        generator.normal(size=after * (before + 1)) * (scale / math.sqrt(before + 1))
        for before, after in pairwise(sizes)
    ]
    return np.concatenate(parts)
