"""docs/wheels.md names what exists, and its examples do what it says."""

import importlib
import re
from pathlib import Path

import numpy as np
import pytest

from bluefoot_mpc.wheels import READY, delta_M, forward, icr, inverse

TEXT = (Path(__file__).parents[2] / "docs" / "wheels.md").read_text(encoding="utf-8")
PLACES = [
    (module, name)
    for module, names in re.findall(r"`((?:[a-z_]+/)+[a-z_]+)(?:: ([\w., ]+))?`", TEXT)
    if module.startswith(("wheels/", "model/"))
    for name in (names.split(", ") if names else [""])
]


@pytest.mark.parametrize(("module", "name"), sorted(set(PLACES)))
def test_every_place_of_the_map_exists(module, name):
    place = importlib.import_module(f"bluefoot_mpc.{module.replace('/', '.')}")
    assert hasattr(place, name) if name else True


def test_the_map_is_not_empty():
    assert len(PLACES) > 60


def test_the_first_example_gives_what_it_says():
    robot = READY["ackermann"]()
    command = inverse(robot, np.array([0.1, 0.0, 0.3]))
    np.testing.assert_allclose(
        forward(robot, command.speeds, command.steering).twist, [0.1, 0, 0.3], atol=1e-12
    )
    np.testing.assert_allclose(icr(robot, command.steering).point, [0, 0.333], atol=1e-3)
    assert delta_M(robot, command.steering) == 2


@pytest.mark.parametrize("code", re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL))
def test_examples_run(code):
    exec(code, {"np": np})
