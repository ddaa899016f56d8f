"""The map from laws to code names what exists."""

import importlib
import re
from pathlib import Path

import pytest

MAP = Path(__file__).parents[1] / "docs" / "theory.md"
PLACES = [
    (module, name)
    for module, names in re.findall(
        r"`((?:[a-z_]+/)+[a-z_]+)(?:: ([\w., ]+))?`", MAP.read_text(encoding="utf-8")
    )
    for name in (names.split(", ") if names else [""])
]


@pytest.mark.parametrize(("module", "name"), sorted(set(PLACES)))
def test_every_place_of_the_map_exists(module, name):
    place = importlib.import_module(f"bluefoot_mpc.{module.replace('/', '.')}")
    for part in filter(None, name.split(".")):
        place = getattr(place, part)


def test_the_map_is_not_empty():
    assert len(PLACES) > 50
