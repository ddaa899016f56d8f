"""Strict conversion between TOML tables and frozen configuration dataclasses.

An unknown key is an error that lists the valid ones, a missing key without a
default is an error, and numbers are checked where they are defined: in each
dataclass's ``__post_init__`` with the ``require_*`` helpers below.
"""

from __future__ import annotations

import dataclasses
import functools
import json
import math
import tomllib
import types
import typing
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError

T = TypeVar("T")


@functools.cache
def _type_hints(cls: Any) -> dict[str, Any]:
    """Types of a dataclass's fields; to work them out takes longer than all else of `build`."""
    return typing.get_type_hints(cls)


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file.

    Raises:
        ConfigurationError: the file is missing, unreadable or not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigurationError(f"cannot read {path}: {error.strerror or error}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigurationError(f"{path} is not a TOML file: {error}") from error


def build(cls: type[T], table: Mapping[str, Any], where: str = "") -> T:
    """Make a configuration dataclass from a TOML table, nested tables included.

    What a nested table does not name keeps the value that the field has by
    default, which need not be the default of the nested dataclass.

    Args:
        cls: a dataclass whose fields are numbers, strings, booleans, tuples of
            them, or dataclasses again.
        table: keys and values as TOML gives them.
        where: name of the table, for messages.

    Raises:
        ConfigurationError: a key is unknown or missing, a type does not fit, or a value is impossible.
    """
    hints = _type_hints(typing.cast("typing.Hashable", cls))
    fields = {f.name: f for f in dataclasses.fields(cls) if f.init}  # type: ignore[arg-type]
    for key in table:
        if key not in fields:
            raise UnknownNameError(f"key in [{where or cls.__name__}]", key, fields)
    values: dict[str, Any] = {}
    for name, field in fields.items():
        label = f"{where}.{name}" if where else name
        if name in table:
            values[name] = _convert(hints[name], _filled(field, table[name]), label)
        elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            raise ConfigurationError(f"missing value: {label}")
    try:
        return cls(**values)
    except ConfigurationError as error:
        message = str(error)
        raise ConfigurationError(f"[{where}] {message}" if where else message) from error


def to_table(config: Any) -> dict[str, Any]:
    """The TOML table (nested, no ``None``) that `build` turns into `config` again."""
    table: dict[str, Any] = {}
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        if value is not None and field.init:
            table[field.name] = _plain(value)
    return table


def merge(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """`base` with the values of `over` on top, table by table; inputs are untouched."""
    merged = dict(base)
    for key, value in over.items():
        if isinstance(value, Mapping) and isinstance(merged.get(key), Mapping):
            merged[key] = merge(merged[key], value)
        else:
            merged[key] = value
    return merged


def parse_override(text: str) -> dict[str, Any]:
    """Turn ``section.key=value`` (value in TOML, or a bare word) into a nested table.

    Raises:
        ConfigurationError: there is no ``=`` or no key.
    """
    path, sign, raw = text.partition("=")
    keys = [part.strip() for part in path.split(".")]
    if not sign or not all(keys):
        raise ConfigurationError(f"'{text}' is not of the form section.key=value")
    try:
        value = tomllib.loads(f"value = {raw}")["value"]
    except tomllib.TOMLDecodeError:
        value = raw.strip()
    for key in reversed(keys):
        value = {key: value}
    return typing.cast(dict[str, Any], value)


def dump_toml(table: Mapping[str, Any]) -> str:
    """Write a nested table as TOML (scalars, lists, tables, lists of tables)."""
    return "\n".join(_toml_lines(table, ())).lstrip("\n") + "\n"


def require_positive(**values: float) -> None:
    """Raise unless every value is finite and > 0."""
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0.0):
            raise ConfigurationError(f"{name} = {value!r} must be positive")


def require_nonnegative(**values: float) -> None:
    """Raise unless every value is finite and >= 0."""
    for name, value in values.items():
        if not (math.isfinite(value) and value >= 0.0):
            raise ConfigurationError(f"{name} = {value!r} must not be negative")


def require_range(low: float, high: float, **values: float) -> None:
    """Raise unless every value lies in [low, high]."""
    for name, value in values.items():
        if not low <= value <= high:
            raise ConfigurationError(f"{name} = {value!r} must lie in {low:g}..{high:g}")


def require_finite(**values: float | Sequence[float]) -> None:
    """Raise unless every number (or every entry of a sequence) is finite."""
    for name, value in values.items():
        entries = value if isinstance(value, Sequence) else (value,)
        if not all(math.isfinite(entry) for entry in entries):
            raise ConfigurationError(f"{name} = {value!r} must be finite")


def _filled(field: dataclasses.Field[Any], value: Any) -> Any:
    """A table for a nested dataclass, filled up with the field's own default."""
    if not isinstance(value, Mapping) or field.default_factory is dataclasses.MISSING:
        return value
    default = field.default_factory()
    return merge(to_table(default), value) if dataclasses.is_dataclass(default) else value


def _convert(hint: Any, value: Any, label: str) -> Any:
    origin = typing.get_origin(hint)
    if origin in (typing.Union, types.UnionType):
        inner = [arg for arg in typing.get_args(hint) if arg is not type(None)]
        return _convert(inner[0], value, label)
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        if not isinstance(value, Mapping):
            raise ConfigurationError(f"{label} must be a table, not {value!r}")
        return build(hint, value, label)
    if origin is tuple:
        return _convert_tuple(hint, value, label)
    return _convert_scalar(hint, value, label)


def _convert_tuple(hint: Any, value: Any, label: str) -> tuple[Any, ...]:
    args = typing.get_args(hint)
    if not isinstance(value, (list, tuple)):
        raise ConfigurationError(f"{label} must be a list, not {value!r}")
    if len(args) == 2 and args[1] is Ellipsis:
        kinds = (args[0],) * len(value)
    elif len(args) == len(value):
        kinds = args
    else:
        raise ConfigurationError(f"{label} must have {len(args)} entries, not {len(value)}")
    return tuple(_convert(k, v, f"{label}[{i}]") for i, (k, v) in enumerate(zip(kinds, value, strict=True)))


def _convert_scalar(hint: Any, value: Any, label: str) -> Any:
    if typing.get_origin(hint) is typing.Literal:
        if value not in typing.get_args(hint):
            raise UnknownNameError(label, str(value), map(str, typing.get_args(hint)))
        return value
    if hint is bool and isinstance(value, bool):
        return value
    if hint is float and isinstance(value, (int, float)) and not isinstance(value, bool):
        if not math.isfinite(value):
            raise ConfigurationError(f"{label} = {value!r} must be finite")
        return float(value)
    if hint is int and isinstance(value, int) and not isinstance(value, bool):
        return value
    if hint is str and isinstance(value, str):
        return value
    name = getattr(hint, "__name__", str(hint))
    raise ConfigurationError(f"{label} = {value!r} must be of type {name}")


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return to_table(value)
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return value


def _toml_lines(table: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    lines: list[str] = []
    nested = {k: v for k, v in table.items() if _is_table(v)}
    for key, value in table.items():
        if key not in nested and value is not None:
            lines.append(f"{key} = {_toml_value(value)}")
    for key, value in nested.items():
        here = (*path, key)
        tables = value if isinstance(value, list) else [value]
        mark = "[[{}]]" if isinstance(value, list) else "[{}]"
        for entry in tables:
            lines += ["", mark.format(".".join(here)), *_toml_lines(entry, here)]
    return lines


def _is_table(value: Any) -> bool:
    if isinstance(value, Mapping):
        return True
    return isinstance(value, list) and bool(value) and all(isinstance(item, Mapping) for item in value)


def _toml_value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        # TOML's basic strings know JSON's escapes, and forbid one more character.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml_value(item) for item in value) + "]"
    return repr(value)
