"""Records of `bluefoot_mpc.types` as JSON and back, bit for bit.

The field types of the dataclasses are the only description: what they can say
(numbers, text, enumerations, arrays, tuples of text, optional and nested
records) needs no further code. Three things that JSON lacks are written so:
NaN is ``null``, infinities are ``"Infinity"`` and ``"-Infinity"``, and arrays
whose shape the brackets cannot tell (an empty ``(0, 3)``) or whose numbers
are bytes (pictures) are objects, ``{"shape": [...], "base64": "..."}``.

Encoding hands the record to orjson as it is and goes field by field only when
the result shows one of those cases: that is ten times faster.
"""

from __future__ import annotations

import base64
import dataclasses
import enum
import functools
import math
import operator
import types
import typing
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
import orjson

from bluefoot_mpc.exceptions import LogError

T = TypeVar("T")
Convert = Callable[[Any], Any]
Values = Callable[[Any], tuple[Any, ...]]

_OPTIONS = orjson.OPT_SERIALIZE_NUMPY


def encode(record: Any) -> bytes:
    """One dataclass record as a JSON object.

    Args:
        record: a record; its arrays must have the type that the field declares
            (a float32 array in a float64 field would come back rounded).
    """
    plan = _plan(type(record))
    if plan.is_plain(record):
        data = orjson.dumps(record, _to_list, _OPTIONS)
        # More nulls than absent fields are NaN or infinities.
        if data.count(b"null") == plan.optional_count or not plan.holds_infinity(record):
            return data
    return orjson.dumps(plan.to_table(record), _to_list, _OPTIONS)


def decode(cls: type[T], data: bytes) -> T:
    """The record of class `cls` that `encode` wrote.

    Raises:
        LogError: the data are not such a record.
    """
    try:
        return typing.cast(T, _plan(cls).from_table(_require(dict, orjson.loads(data))))
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        reason = f"it lacks {error}" if isinstance(error, KeyError) else str(error)
        raise LogError(f"not a record of type {cls.__name__}: {reason}") from error


@dataclass(frozen=True, kw_only=True, slots=True)
class _Plan:
    """How to write and read one dataclass, worked out once from its field types."""

    cls: type
    writers: tuple[tuple[str, Convert | None], ...]
    readers: tuple[tuple[str, Convert, bool], ...]
    has_bytes: bool
    optional_count: int
    optional: Values
    arrays: Values
    float_arrays: Values
    floats: Values

    def is_plain(self, record: Any) -> bool:
        """True where no field needs to be written otherwise, but for infinities."""
        if self.has_bytes or self.optional(record).count(None) < self.optional_count:
            return False
        return 0 not in [array.size for array in self.arrays(record)]

    def holds_infinity(self, record: Any) -> bool:
        """True where a number of a plain record is infinite."""
        arrays = self.float_arrays(record)
        if arrays and np.count_nonzero(np.isinf(np.concatenate(arrays, axis=None))):
            return True
        return any(map(math.isinf, self.floats(record)))

    def to_table(self, record: Any) -> dict[str, Any]:
        return {
            name: getattr(record, name) if write is None else write(getattr(record, name))
            for name, write in self.writers
        }

    def from_table(self, table: dict[str, Any]) -> Any:
        values = {
            name: read(table[name])
            for name, read, has_default in self.readers
            if name in table or not has_default
        }
        return self.cls(**values)


def _make_plan(cls: type) -> _Plan:
    hints = typing.get_type_hints(cls)
    fields = [f for f in dataclasses.fields(cls) if f.init]
    optional = _paths(cls, lambda hint: unwrap_optional(hint)[1])
    return _Plan(
        cls=cls,
        writers=tuple((f.name, _writer(hints[f.name])) for f in fields),
        readers=tuple((f.name, _reader(hints[f.name]), _has_default(f)) for f in fields),
        has_bytes=bool(_paths(cls, lambda hint: array_type(hint) == np.uint8)),
        optional_count=len(optional),
        optional=_values(optional),
        arrays=_values(_paths(cls, lambda hint: array_type(hint) is not None)),
        float_arrays=_values(_paths(cls, lambda hint: getattr(array_type(hint), "kind", "") == "f")),
        floats=_values(_paths(cls, lambda hint: hint is float)),
    )


_plan: Callable[[type], _Plan] = functools.cache(_make_plan)


def unwrap_optional(hint: Any) -> tuple[Any, bool]:
    """``(X, True)`` of ``X | None``, and ``(hint, False)`` of any other type."""
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        inner = [arg for arg in typing.get_args(hint) if arg is not type(None)]
        if len(inner) == 1:
            return inner[0], True
    return hint, False


def array_type(hint: Any) -> np.dtype[Any] | None:
    """The dtype of an ``NDArray[...]`` type, None of any other type."""
    if typing.get_origin(hint) is not np.ndarray:
        return None
    dtype: np.dtype[Any] = np.dtype(typing.get_args(typing.get_args(hint)[1])[0])
    return dtype


def is_record(hint: Any) -> bool:
    """True of a dataclass."""
    return isinstance(hint, type) and dataclasses.is_dataclass(hint)


def _has_default(field: dataclasses.Field[Any]) -> bool:
    return field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING


def _paths(cls: type, wanted: Callable[[Any], bool], prefix: str = "") -> list[str]:
    """Dotted names of the wanted fields of a record and of the records that it always holds."""
    found: list[str] = []
    for name, hint in typing.get_type_hints(cls).items():
        if wanted(hint):
            found.append(prefix + name)
        elif is_record(hint):
            found.extend(_paths(hint, wanted, f"{prefix}{name}."))
    return found


def _values(paths: list[str]) -> Values:
    """Function that gives a record's values at some dotted names."""
    if not paths:
        return lambda record: ()
    get = operator.attrgetter(*paths)
    return get if len(paths) > 1 else lambda record: (get(record),)


def _writer(hint: Any) -> Convert | None:
    """Function from a field's value to what JSON can hold; None where nothing is to do."""
    inner, optional = unwrap_optional(hint)
    if optional:
        write = _writer(inner)
        return None if write is None else lambda value: None if value is None else write(value)
    if is_record(inner):
        return lambda value: _plan(inner).to_table(value)
    dtype = array_type(inner)
    if dtype is not None:
        return _write_bytes if dtype == np.uint8 else _write_array
    return _write_float if inner is float else None


def _write_array(array: np.ndarray[Any, Any]) -> Any:
    if array.size == 0 and array.ndim > 1:
        return {"shape": list(array.shape)}
    if array.dtype.kind == "f" and np.isinf(array).any():
        return _name_infinities(array.tolist())
    return array


def _write_bytes(array: np.ndarray[Any, Any]) -> dict[str, Any]:
    text = base64.b64encode(array.tobytes()).decode("ascii")
    return {"shape": list(array.shape), "base64": text}


def _write_float(value: float) -> float | str:
    return repr(float(value)).replace("inf", "Infinity") if math.isinf(value) else value


def _name_infinities(values: Any) -> Any:
    return [_name_infinities(v) for v in values] if isinstance(values, list) else _write_float(values)


def _to_list(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"a record cannot hold {type(value).__name__}")


def _reader(hint: Any) -> Convert:
    """Function from what JSON held to a field's value."""
    inner, optional = unwrap_optional(hint)
    if optional:
        read = _reader(inner)
        return lambda value: None if value is None else read(value)
    if is_record(inner):
        return lambda value: _plan(inner).from_table(_require(dict, value))
    dtype = array_type(inner)
    if dtype is not None:
        return functools.partial(_read_array, dtype=dtype)
    if typing.get_origin(inner) is tuple:
        read_item = _reader(typing.get_args(inner)[0])
        return lambda values: tuple(read_item(value) for value in _require(list, values))
    return _scalar_reader(inner)


def _scalar_reader(hint: Any) -> Convert:
    if hint is float:
        return lambda value: math.nan if value is None else float(value)
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return hint
    if hint in (bool, int, str):
        return functools.partial(_require, hint)
    raise TypeError(f"no rule for fields of type {hint}")


def _read_array(value: Any, dtype: np.dtype[Any]) -> np.ndarray[Any, Any]:
    if isinstance(value, dict):
        data = base64.b64decode(value.get("base64", ""), validate=True)
        return np.frombuffer(data, dtype).reshape(value["shape"]).copy()
    # numpy reads None as NaN and the names of the infinities as numbers.
    return np.array(_require(list, value), dtype)


def _require(kind: type, value: Any) -> Any:
    if not isinstance(value, kind):
        raise TypeError(f"{value!r} where {kind.__name__} is expected")
    return value
