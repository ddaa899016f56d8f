import pytest

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.gait.table import BOUNDS
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.options import CONTROLLERS
from bluefoot_mpc.scenarios.registry import find_scenario
from bluefoot_mpc.tuning.space import SPACES, Parameter, Space, trot_space

HEIGHT = Parameter(name="height", keys=("control.posture.trunk_height",), low=0.1, high=0.13)
CYCLE = Parameter(
    name="cycle", keys=("control.gait.trot.cycle_min", "control.gait.trot.cycle_max"), low=0.2, high=0.5
)
SPACE = Space(parameters=(HEIGHT, CYCLE), fixed=("control.zmp.enabled=false",))


def test_overrides_of_a_point_set_every_key_after_the_fixed_ones():
    assert SPACE.overrides({"cycle": 0.3, "height": 0.12}) == (
        "control.zmp.enabled=false",
        "control.posture.trunk_height=0.12",
        "control.gait.trot.cycle_min=0.3",
        "control.gait.trot.cycle_max=0.3",
    )


def test_settings_that_are_lists_get_one_entry():
    column = Parameter(name="a", keys=("x.a",), low=0.0, high=1.0, listed=True)
    assert Space(parameters=(column,)).overrides({"a": 0.5}) == ("x.a=[0.5]",)


def test_values_are_cut_to_their_ranges():
    assert SPACE.checked({"height": 0.5, "cycle": 0.0}) == {"height": 0.13, "cycle": 0.2}


def test_steps_count_from_the_lowest_value():
    cycle = Parameter(name="cycle", keys=("a.b",), low=0.2, high=0.52, step=0.04)
    assert cycle.clipped(0.33) == pytest.approx(0.32)
    assert cycle.clipped(0.9) == 0.52


def test_unknown_and_missing_values_are_named():
    with pytest.raises(UnknownNameError, match="hieght"):
        SPACE.checked({"hieght": 0.1, "cycle": 0.3})
    with pytest.raises(ConfigurationError, match="no value for cycle"):
        SPACE.checked({"height": 0.1})


@pytest.mark.parametrize(
    "make",
    [
        lambda: Parameter(name="a", keys=(), low=0.0, high=1.0),
        lambda: Parameter(name="a", keys=("a.b",), low=1.0, high=1.0),
        lambda: Parameter(name="a", keys=("a.b",), low=0.0, high=1.0, log=True),
        lambda: Parameter(name="a", keys=("a.b",), low=0.1, high=1.0, step=0.1, log=True),
        lambda: Space(parameters=()),
        lambda: Space(parameters=(HEIGHT, HEIGHT)),
        lambda: trot_space("magic"),
    ],
)
def test_impossible_spaces_are_refused(make):
    with pytest.raises(ConfigurationError):
        make()


@pytest.mark.parametrize("controller", CONTROLLERS)
@pytest.mark.parametrize("gait", sorted(SPACES))
@pytest.mark.parametrize("law", ["minimum_jerk", "virtual_force"])
@pytest.mark.parametrize("corner", ["low", "high"])
def test_a_point_of_a_shipped_space_is_what_the_gait_gets(controller, gait, law, corner):
    space = SPACES[gait](law)
    values = {p.name: getattr(p, corner) for p in space.parameters}
    options = RunOptions(controller=controller, overrides=space.overrides(values))
    table = resolve(find_scenario("walk"), options).stages.control.gait.table(gait)
    assert table.speed == (0.0,)
    assert table.law == (law,)
    for name in BOUNDS:
        assert getattr(table, name) == ((values[name],) if name in values else ())
