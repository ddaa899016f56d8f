"""The schemas say what the messages hold, in the words that viewers know."""

from __future__ import annotations

from typing import Any

import numpy as np
import orjson
import pytest

from bluefoot_mpc.runtime.codec import encode
from bluefoot_mpc.runtime.recorder import RECORD_CLASSES
from bluefoot_mpc.runtime.schema import json_schema
from tests.runtime.made_up_run import make_run

SCALARS = {"boolean": bool, "integer": int, "number": (int, float), "string": str, "object": dict}


def check(schema: dict[str, Any], value: Any, path: str) -> None:
    """Fail where a value does not fit, or where the schema uses words that Foxglove refuses."""
    assert isinstance(schema["type"], str), path
    if value is None:
        return
    if schema["type"] == "array":
        assert schema["items"]["type"] != "array", f"{path}: viewers refuse arrays of arrays"
        assert schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", 10**6), path
        for item in value:
            check(schema["items"], item, path)
        return
    assert isinstance(value, SCALARS[schema["type"]]), f"{path} = {value!r} is no {schema['type']}"
    for name, part in schema.get("properties", {}).items():
        assert name in value, f"{path}.{name}"
        if "oneOf" in part:
            assert value[name] in [choice["const"] for choice in part["oneOf"]]
        else:
            check(part, value[name], f"{path}.{name}")


@pytest.mark.parametrize("topic", list(RECORD_CLASSES))
def test_schema_fits_the_messages(topic: str) -> None:
    schema = json_schema(RECORD_CLASSES[topic])
    for record in make_run(9).records(topic):
        check(schema, orjson.loads(encode(record)), topic)


@pytest.mark.parametrize("topic", list(RECORD_CLASSES))
def test_every_vector_is_declared_and_described(topic: str) -> None:
    record = make_run(4).records(topic)[-1]
    properties = json_schema(type(record))["properties"]
    for name in record.__dataclass_fields__:
        value = getattr(record, name)
        assert name in properties or (isinstance(value, np.ndarray) and value.ndim > 1), name
        if name in properties:
            assert properties[name]["description"], f"{name} has no line in the docstring"
