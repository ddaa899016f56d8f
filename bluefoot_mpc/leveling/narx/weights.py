"""Weights of a network as a value, and the file that keeps them (.npz, without pickled objects)."""

from __future__ import annotations

import contextlib
import os
import tokenize
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.types import FloatArray

VERSION = 1
"""Version of the file's layout and of the meaning of the weights."""
_LAYERS = ("layer_1", "layer_2", "layer_3")
_KEYS = ("version", "delays", "input_scale", "output_scale", *_LAYERS)
_ANEW = "train a network anew and save it with this version"
_ZIP, _ARRAY = b"PK", b"\x93NUMPY"  # how an archive of arrays begins, and a file of one array
# What numpy and zipfile raise on bytes that are no archive of arrays. SyntaxError and TokenError come from
# the text that describes an array, MemoryError from a giant shape, RuntimeError from an encrypted member.
_DAMAGE = (
    ValueError,
    TypeError,
    EOFError,
    KeyError,
    RuntimeError,
    SyntaxError,
    MemoryError,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class NarxWeights:
    """Weights, and the sizes and scales without which they mean nothing.

    Attributes:
        layers: three arrays (neurons, inputs + 1), last column = bias. Inputs of
            the first are the scaled inputs, newest sample first, then the
            fed-back outputs, newest first.
        delays: n, samples of inputs and of outputs.
        input_scale: (nu,) unit of each input, SI.
        output_scale: (ny,) unit of each output, SI.
    """

    layers: tuple[FloatArray, FloatArray, FloatArray]
    delays: int
    input_scale: FloatArray
    output_scale: FloatArray

    def __post_init__(self) -> None:
        """Check that sizes fit each other, and that all is finite."""
        check_scale("input_scale", self.input_scale)
        check_scale("output_scale", self.output_scale)
        if self.delays < 1:
            raise ConfigurationError(f"delays = {self.delays!r} must be at least 1; {_ANEW}")
        for name, layer in zip(_LAYERS, self.layers, strict=True):
            if layer.ndim != 2 or layer.dtype != np.float64:
                raise ConfigurationError(
                    f"{name} is an array {layer.shape} of {layer.dtype}, not a matrix of float64; {_ANEW}"
                )
            if not np.isfinite(layer).all():
                bad = int(layer.size - np.isfinite(layer).sum())
                raise ConfigurationError(f"{name} has {bad} weights that are not finite; {_ANEW}")
        self._check_chain()

    def _check_chain(self) -> None:
        first, second, third = (layer.shape for layer in self.layers)
        inputs, outputs = len(self.input_scale), len(self.output_scale)
        wanted = (
            (first[0], self.delays * (inputs + outputs) + 1),
            (second[0], first[0] + 1),
            (outputs, second[0] + 1),
        )
        if (first, second, third) != wanted:
            raise ConfigurationError(
                f"layers of shapes {first}, {second}, {third} do not fit {inputs} inputs, {outputs} outputs "
                f"and {self.delays} delays, which want {wanted[0]}, {wanted[1]}, {wanted[2]}; {_ANEW}"
            )

    @property
    def hidden(self) -> tuple[int, int]:
        """Neurons of the two hidden layers."""
        return self.layers[0].shape[0], self.layers[1].shape[0]


def check_scale(name: str, scale: FloatArray) -> None:
    """Check a vector of scales.

    Raises:
        ConfigurationError: it is no vector, empty, or has an entry that is not finite and positive.
    """
    if scale.ndim != 1 or scale.size == 0:
        raise ConfigurationError(
            f"{name} must be a vector with one scale per signal, not of shape {scale.shape}"
        )
    if scale.dtype.kind not in "fiu":
        raise ConfigurationError(f"{name} must be numbers, not {scale.dtype}")
    # Also the inverse, by which signals are multiplied, must be a number.
    bad = np.flatnonzero(~((scale > 1e-100) & (scale < 1e100)))
    if bad.size:
        raise ConfigurationError(
            f"{name}[{bad[0]}] = {scale[bad[0]]!r} must be positive and finite: "
            f"the size in SI units that counts as one"
        )


def save_weights(path: Path, weights: NarxWeights) -> None:
    """Write weights to a file, all or nothing: a reader never finds half of them.

    Raises:
        ConfigurationError: the file cannot be written.
    """
    first, second, third = weights.layers
    temporary = path.with_name(f"{path.name}.{os.getpid()}.tmp")
    try:
        with temporary.open("wb") as stream:
            np.savez(
                stream,
                version=np.int64(VERSION),
                delays=np.int64(weights.delays),
                input_scale=weights.input_scale,
                output_scale=weights.output_scale,
                layer_1=first,
                layer_2=second,
                layer_3=third,
            )
        os.replace(temporary, path)
    except OSError as error:
        raise ConfigurationError(
            f"cannot write weights to {path}: {error.strerror or error}; name a file in a folder "
            f"that exists and may be written"
        ) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def load_weights(path: Path) -> NarxWeights:
    """Read the file that `save_weights` wrote.

    Raises:
        ConfigurationError: the file is missing, damaged, of another version, or its parts do not fit.
    """
    values = _read(path)
    if "version" not in values:
        raise ConfigurationError(f"{path} holds no weights of this package: it names no version; {_ANEW}")
    version = values["version"]
    if version.ndim or version.dtype.kind not in "iu" or int(version) != VERSION:
        raise ConfigurationError(f"{path} has version {version} of weights, wanted is {VERSION}; {_ANEW}")
    missing = [key for key in _KEYS if key not in values]
    if missing:
        raise ConfigurationError(f"{path} lacks {', '.join(missing)}; {_ANEW}")
    delays = values["delays"]
    if delays.ndim or delays.dtype.kind not in "iu":
        raise ConfigurationError(f"{path}: delays = {delays} must be a whole number; {_ANEW}")
    first, second, third = (values[key] for key in _LAYERS)
    try:
        return NarxWeights(
            layers=(first, second, third),
            delays=int(delays),
            input_scale=values["input_scale"],
            output_scale=values["output_scale"],
        )
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: {error}") from error


def _read(path: Path) -> dict[str, FloatArray]:
    """The arrays of the file that are known by name."""
    try:
        with path.open("rb") as stream:
            _check_kind(path, stream)
            return _read_archive(path, stream)
    except OSError as error:
        raise ConfigurationError(
            f"cannot read weights from {path}: {error.strerror or error}; name a file that was saved"
        ) from error


def _check_kind(path: Path, stream: BinaryIO) -> None:
    """See by its first bytes what the file is: numpy would take any other for pickled objects."""
    start = stream.read(len(_ARRAY))
    stream.seek(0)
    if start == _ARRAY:
        raise ConfigurationError(f"{path} holds one array, not weights of a network; {_ANEW}")
    if not start.startswith(_ZIP):
        raise ConfigurationError(
            f"{path} is damaged or no file of weights: it does not begin as an .npz file does; "
            f"name a file that was saved, copy it again, or {_ANEW}"
        )


def _read_archive(path: Path, stream: BinaryIO) -> dict[str, FloatArray]:
    values: dict[str, FloatArray] = {}
    part = "its list of arrays"
    try:
        with np.load(stream, allow_pickle=False) as archive:
            for key in _KEYS:
                if key in archive.files:
                    part = key
                    values[key] = _array(archive[key])
    except _DAMAGE as error:
        raise ConfigurationError(
            f"{path} is damaged or no file of weights: {part} cannot be read; copy it again, or {_ANEW}"
        ) from error
    return values


def _array(member: object) -> FloatArray:
    """A member of the archive, which numpy hands on as plain bytes where it is no array."""
    if not isinstance(member, np.ndarray):
        raise ValueError("no array")
    return member
