"""JSON schemas of the records, for viewers such as Foxglove.

Names and kinds of the fields come from the dataclasses, sizes and descriptions
from their docstrings. A viewer that reads MCAP with JSON schemas wants one
``type`` per field and no arrays of arrays: fields with two and more dimensions
are in the messages but not in the schema, which leaves them visible as raw
values.
"""

from __future__ import annotations

import dataclasses
import enum
import inspect
import re
import typing
from typing import Any

import numpy as np

from bluefoot_mpc.runtime.codec import array_type, is_record, unwrap_optional

_ENTRY = re.compile(r"^    (\w+): (.*(?:\n      .*)*)", re.MULTILINE)
_SHAPE = re.compile(r"^\(([\w, ]*)\)")


def json_schema(cls: type) -> dict[str, Any]:
    """The JSON schema of a dataclass as `bluefoot_mpc.runtime.codec.encode` writes it."""
    doc = inspect.getdoc(cls) or ""
    notes = {name: " ".join(text.split()) for name, text in _ENTRY.findall(doc)}
    hints = typing.get_type_hints(cls)
    properties: dict[str, Any] = {}
    for field in dataclasses.fields(cls):
        schema = _field_schema(hints[field.name], notes.get(field.name, ""))
        if schema is not None:
            properties[field.name] = {**schema, "description": notes.get(field.name, "")}
    return {
        "type": "object",
        "title": cls.__name__,
        "description": doc.split("\n")[0],
        "properties": properties,
    }


def _field_schema(hint: Any, note: str) -> dict[str, Any] | None:
    inner, _ = unwrap_optional(hint)
    if is_record(inner):
        return json_schema(inner)
    dtype = array_type(inner)
    if dtype is not None:
        return _array_schema(dtype, note)
    if typing.get_origin(inner) is tuple:
        return {"type": "array", "items": {"type": "string"}}
    if issubclass(inner, enum.IntEnum):
        return {"oneOf": [{"title": member.name, "const": member.value} for member in inner]}
    return {"type": {bool: "boolean", int: "integer", float: "number"}.get(inner, "string")}


def _array_schema(dtype: np.dtype[Any], note: str) -> dict[str, Any] | None:
    if dtype == np.uint8:
        text = {"type": "string", "contentEncoding": "base64"}
        shape = {"type": "array", "items": {"type": "integer"}}
        return {"type": "object", "properties": {"shape": shape, "base64": text}}
    match = _SHAPE.match(note)
    sizes = [size for size in match[1].replace(" ", "").split(",") if size] if match else []
    if len(sizes) != 1:
        return None
    schema: dict[str, Any] = {
        "type": "array",
        "items": {"type": "boolean" if dtype.kind == "b" else "number"},
    }
    if sizes[0].isdigit():
        schema |= {"minItems": int(sizes[0]), "maxItems": int(sizes[0])}
    return schema
