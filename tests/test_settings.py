import math
import tomllib
from dataclasses import dataclass, field, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.gait.config import GaitConfig
from bluefoot_mpc.settings import (
    build,
    dump_toml,
    merge,
    parse_override,
    read_toml,
    require_finite,
    require_nonnegative,
    require_positive,
    require_range,
    to_table,
)


@dataclass(frozen=True, kw_only=True, slots=True)
class Inner:
    gain: float = 1.0
    count: int = 2


@dataclass(frozen=True, kw_only=True, slots=True)
class Middle:
    inner: Inner = field(default_factory=lambda: Inner(gain=4.0, count=40))
    scale: float = 1.0


@dataclass(frozen=True, kw_only=True, slots=True)
class Outer:
    name: str
    on: bool = False
    inner: Inner = field(default_factory=Inner)
    middle: Middle = field(default_factory=lambda: Middle(scale=3.0))
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shares: tuple[float, ...] = ()
    inners: tuple[Inner, ...] = ()
    limit: float | None = None

    def __post_init__(self) -> None:
        require_finite(place=self.place)


TEXT = st.text(alphabet=st.characters(blacklist_categories=["Cs"]))
SCALARS = (
    st.booleans() | st.integers(-(2**53), 2**53) | st.floats(allow_nan=False, allow_infinity=False) | TEXT
)
KEYS = st.text(alphabet="abcxyz_-019", min_size=1, max_size=6)
TABLES = st.recursive(
    st.dictionaries(KEYS, SCALARS | st.lists(st.floats(allow_nan=False, allow_infinity=False))),
    lambda inner: st.dictionaries(KEYS, SCALARS | inner | st.lists(inner, min_size=1, max_size=2)),
    max_leaves=8,
)


@given(TABLES)
def test_what_is_written_reads_back(table):
    assert tomllib.loads(dump_toml(table)) == table


def test_a_configuration_survives_a_file(tmp_path):
    config = Outer(
        name='a "quoted"\\path\n', on=True, inner=Inner(gain=2.5), place=(1.0, -2.0, 3e-9), shares=(0.1, 0.2),
        inners=(Inner(), Inner(count=5)), limit=0.5,
    )  # fmt: skip
    path = tmp_path / "config.toml"
    path.write_text(dump_toml(to_table(config)), encoding="utf-8")
    assert build(Outer, read_toml(path)) == config
    assert "limit" not in to_table(Outer(name="x"))


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"name": "x", "gian": 1.0}, "gian"),
        ({}, "missing value: name"),
        ({"name": 3}, "name = 3 must be of type str"),
        ({"name": "x", "on": 1}, "on = 1 must be of type bool"),
        ({"name": "x", "inner": 1.0}, "inner must be a table"),
        ({"name": "x", "inner": {"gain": True}}, r"inner.gain = True must be of type float"),
        ({"name": "x", "inner": {"count": 2.0}}, r"inner.count = 2.0 must be of type int"),
        ({"name": "x", "inner": {"count": True}}, r"inner.count = True must be of type int"),
        ({"name": "x", "inner": {"gain": math.nan}}, "must be finite"),
        ({"name": "x", "place": [1.0, 2.0]}, "place must have 3 entries, not 2"),
        ({"name": "x", "place": 1.0}, "place must be a list"),
        ({"name": "x", "shares": [0.1, "a"]}, r"shares\[1\]"),
        ({"name": "x", "inners": [{}, {"gian": 1}]}, r"inners\[1\]"),
    ],
)
def test_a_bad_table_is_refused_by_name(table, message):
    with pytest.raises(ConfigurationError, match=message):
        build(Outer, table)


def test_an_unknown_key_lists_the_valid_ones():
    with pytest.raises(UnknownNameError, match="count, gain"):
        build(Outer, {"name": "x", "inner": {"gian": 1.0}})


def test_a_part_of_a_table_keeps_the_fields_own_defaults():
    built = build(Outer, {"name": "x", "middle": {"inner": {"gain": 5.0}}})
    assert built.middle == Middle(scale=3.0, inner=Inner(gain=5.0, count=40))
    assert build(Outer, {"name": "x", "middle": {}}).middle.scale == 3.0


def test_part_of_a_gaits_timing_does_not_make_it_another_gait():
    walk = build(GaitConfig, {"walk": {"cycle_max": 1.4}}).walk
    assert walk == replace(GaitConfig().walk, cycle_max=1.4)


def test_whole_numbers_are_floats_where_floats_are_wanted():
    assert isinstance(build(Inner, {"gain": 3}).gain, float)


def test_merging_goes_into_tables_and_replaces_the_rest():
    base = {"a": {"x": 1, "y": 2}, "b": 3, "c": {"z": 4}}
    over = {"a": {"y": 5}, "b": {"new": 6}, "c": 7}
    assert merge(base, over) == {"a": {"x": 1, "y": 5}, "b": {"new": 6}, "c": 7}
    assert base == {"a": {"x": 1, "y": 2}, "b": 3, "c": {"z": 4}}


@pytest.mark.parametrize(
    ("text", "table"),
    [
        ("a.b=1.5", {"a": {"b": 1.5}}),
        ("a=true", {"a": True}),
        ("a.b.c=[1, 2]", {"a": {"b": {"c": [1, 2]}}}),
        ("a = walk", {"a": "walk"}),
        ("a='x=y'", {"a": "x=y"}),
        ("a=x=y", {"a": "x=y"}),
    ],
)
def test_overrides(text, table):
    assert parse_override(text) == table


@pytest.mark.parametrize("text", ["a", "=1", "a.=1", ".b=1", "a..b=1"])
def test_bad_overrides_are_refused(text):
    with pytest.raises(ConfigurationError, match="section.key=value"):
        parse_override(text)


@pytest.mark.parametrize("content", [b"a = ", b"\xff\xfe", None])
def test_files_that_are_none_are_refused(tmp_path, content):
    path = tmp_path / "x.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ConfigurationError, match=r"x\.toml"):
        read_toml(path)


def test_checks_of_numbers():
    require_positive(a=1e-300)
    require_nonnegative(a=0.0)
    require_range(0.0, 1.0, a=0.0, b=1.0)
    require_finite(a=1.0, b=(2.0, 3.0))
    for check, value in (
        (require_positive, 0.0), (require_positive, math.inf), (require_positive, math.nan),
        (require_nonnegative, -1e-12), (require_nonnegative, math.inf), (require_nonnegative, math.nan),
        (require_finite, math.nan), (require_finite, (0.0, -math.inf)),
    ):  # fmt: skip
        with pytest.raises(ConfigurationError, match="a = "):
            check(a=value)
    for value in (-1e-9, 1.0 + 1e-9, math.nan):
        with pytest.raises(ConfigurationError, match=r"0\.\.1"):
            require_range(0.0, 1.0, a=value)
