"""Plans as files: there and back, and what is refused with cause and way out."""

from pathlib import Path

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.sim.config import WorldConfig
from bluefoot_mpc.sim.worlds.files import read_plan, write_plan
from bluefoot_mpc.sim.worlds.make import KINDS, make_plan, world_plan
from bluefoot_mpc.sim.worlds.plan import Marker, Solid, WorldPlan

SMALL = """
bounds = [-1.0, -1.0, 3.0, 1.0]

[[solids]]
name = "crate"
shape = "box"
x = 2.0
y = 0.5
size = [0.3, 0.3, 0.4]
"""


@pytest.mark.parametrize("kind", KINDS)
def test_plans_come_back_as_they_were(kind, tmp_path):
    for seed in range(5):
        file = tmp_path / f"{kind}{seed}.toml"
        write_plan(make_plan(kind, seed), file)
        assert read_plan(file) == make_plan(kind, seed)


def test_a_small_file_is_filled_up(tmp_path):
    file = tmp_path / "my_room.toml"
    file.write_text(SMALL)
    plan = read_plan(file)
    assert (plan.name, plan.seed, plan.marker) == ("my_room", 0, None)
    assert plan.solids[0].z == pytest.approx(0.2)
    assert world_plan(WorldConfig(name=str(file)), 3) == plan


@pytest.mark.parametrize(
    ("old", "new", "cause"),
    [
        ("bounds = [-1.0, -1.0, 3.0, 1.0]", "", "no bounds. Add a line"),
        ("3.0, 1.0]", "nan, 1.0]", "must be finite"),
        ("3.0, 1.0]", "3.0]", "must have 4 entries"),
        ("-1.0, -1.0, 3.0, 1.0", "1.0, -1.0, 3.0, 1.0", "must hold the origin"),
        ("3.0, 1.0]", "59.5, 1.0]", "at most 60 m"),
        ("x = 2.0", "x = nan", "must be finite"),
        ("x = 2.0", "x = inf", "must be finite"),
        ("x = 2.0", "", "missing value: solids\\[0\\].x"),
        ('x = 2.0\ny = 0.5', "x = 0.3\ny = 0.1", "'crate' stands in the start: .* move the solid"),
        ("[0.3, 0.3, 0.4]", "[0.3, 0.3, 0.0]", "height = 0.0 must be positive"),
        ("[0.3, 0.3, 0.4]", "[0.3, 0.4]", "must have 3 entries"),
        ("y = 0.5", "y = 0.5\nz = -1.0", "below the floor"),
        ("y = 0.5", "y = 0.5\ncolour = [2.0, 0.0, 0.0]", "red = 2.0 must lie in 0..1"),
        ("[0.3, 0.3, 0.4]", '"big"', "must be a list"),
        ('name = "crate"', 'name = "floor"', "not one of: floor"),
        ('name = "crate"', 'name = ""', "must have a name"),
        ("size = [0.3, 0.3, 0.4]", "", "missing value: solids\\[0\\].size"),
        ("[[solids]]", "[marker]\nx = 0.1\ny = 0.1\n\n[[solids]]", "the marker stands in the start"),
        ("[[solids]]", "[marker]\nx = 1.0\ny = 0.0\nz = 0.01\n\n[[solids]]", "at least its radius"),
        ("[[solids]]", "[marker]\nx = 2.0\ny = 0.5\n\n[[solids]]", "the marker stands in 'crate': move"),
        ("[[solids]]", "[marker]\nx = 2.2\ny = 0.5\n\n[[solids]]", "the marker stands in 'crate': move"),
        ("[[solids]]", "[marker]\nx = 20.0\ny = 0.0\n\n[[solids]]", "is outside the bounds .* widen them"),
        ("[[solids]]", "[marker]\nx = 1.0\ny = -1.1\n\n[[solids]]", "is outside the bounds"),
        ("x = 2.0", "x = 1e308", "x = 1e\\+308 must lie in -60..60"),
        ("y = 0.5", "y = -61.0", "y = -61.0 must lie in -60..60"),
        ("[0.3, 0.3, 0.4]", "[0.3, 1e200, 0.4]", "width = 1e\\+200 must lie in 0..120"),
        ("3.0, 1.0]", "1e308, 1.0]", "greatest_x = 1e\\+308 must lie in -60..60"),
        ("-1.0, -1.0, 3.0, 1.0", "3.0, -1.0, -1.0, 1.0", "least x and least y come first"),
        ("bounds = ", "colour = 3\nbounds = ", "unknown key 'colour'. .*Valid: bounds, floor, marker"),
        ("bounds = ", "bounds == ", "is not a TOML file"),
    ],
)  # fmt: skip
def test_bad_files_are_refused_with_the_cause(tmp_path, old, new, cause):
    assert old in SMALL
    file = tmp_path / "bad.toml"
    file.write_text(SMALL.replace(old, new))
    with pytest.raises(ConfigurationError, match=cause) as caught:
        read_plan(file)
    assert str(file) in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "hint"), [("shape", "shaep", "shape"), ("bounds =", "size = 3\nbounds =", "bounds")]
)
def test_unknown_keys_are_told_with_the_valid_ones(tmp_path, old, new, hint):
    file = tmp_path / "bad.toml"
    file.write_text(SMALL.replace(old, new))
    with pytest.raises(ConfigurationError, match=f"unknown key.*{hint}"):
        read_plan(file)


def test_a_marker_may_be_under_over_and_beside_a_thing(tmp_path):
    file = tmp_path / "good.toml"
    file.write_text(SMALL.replace("y = 0.5", "y = 0.5\nz = 0.6") + "\n[marker]\nx = 2.0\ny = 0.5\n")
    assert read_plan(file).marker == Marker(x=2.0, y=0.5)
    file.write_text(SMALL + "\n[marker]\nx = 2.0\ny = 0.5\nz = 0.47\n")
    assert read_plan(file).marker == Marker(x=2.0, y=0.5, z=0.47)
    file.write_text(SMALL + "\n[marker]\nx = 2.22\ny = 0.5\n")
    assert read_plan(file).marker == Marker(x=2.22, y=0.5)


def test_unknown_shape_is_told_with_the_valid_ones(tmp_path):
    file = tmp_path / "bad.toml"
    file.write_text(SMALL.replace('"box"', '"ball"'))
    with pytest.raises(ConfigurationError, match="box, cylinder"):
        read_plan(file)


def test_the_file_of_the_documentation_is_a_plan(tmp_path):
    page = Path(__file__).parents[3] / "docs" / "worlds.md"
    text = page.read_text(encoding="utf-8").split("```toml\n")[1].split("```")[0]
    file = tmp_path / "example.toml"
    file.write_text(text, encoding="utf-8")
    plan = read_plan(file)
    assert plan.marker == Marker(x=4.2, y=1.0)
    assert plan.solids[0].z == pytest.approx(0.25)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(ConfigurationError, match="cannot read"):
        read_plan(tmp_path / "none.toml")


def test_a_file_that_cannot_be_written(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(ConfigurationError, match="cannot write"):
        write_plan(make_plan("room", 0), tmp_path / "file" / "room.toml")


def test_plans_themselves_refuse_what_cannot_be():
    post = Solid(name="post", shape="cylinder", x=1.0, y=0.0, z=0.25, size=(0.1, 0.1, 0.5))
    with pytest.raises(ConfigurationError, match="two solids have the name 'post'"):
        WorldPlan(name="w", seed=0, bounds=(-1.0, -1.0, 2.0, 1.0), solids=(post, post))
    with pytest.raises(ConfigurationError, match="as wide as long"):
        Solid(name="oval", shape="cylinder", x=1.0, y=0.0, z=0.25, size=(0.1, 0.2, 0.5))
    with pytest.raises(ConfigurationError, match="must be finite"):
        Marker(x=np.nan, y=0.0)
    assert issubclass(UnknownNameError, ConfigurationError)
