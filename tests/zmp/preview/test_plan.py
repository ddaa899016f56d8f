import numpy as np
import pytest

from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.types import Fallback
from bluefoot_mpc.zmp.preview import ComPlan, PreviewConfig, PreviewController
from bluefoot_mpc.zmp.preview.plan import carried, shifted
from tests.zmp.preview import scenes

CONFIG = PreviewConfig(samples=16, interval=0.06)


@pytest.fixture(scope="module")
def plan():
    state = np.array([[0.004, 0.002], [0.03, -0.05], [0.1, 0.0]])
    return PreviewController(CONFIG).step(scenes.inputs(scenes.walk(CONFIG, 0.1), state=state), 0.02)


def test_it_passes_through_its_samples(plan):
    assert np.array_equal(plan.at(0.0), plan.start)
    for k, time in enumerate(plan.time):
        wanted = np.stack([plan.position[k], plan.velocity[k], plan.acceleration[k]])
        assert plan.at(time) == pytest.approx(wanted, abs=1e-9)


def test_it_is_smooth_between_them(plan):
    step = 1e-6
    for time in (0.013, 0.0601, 0.5, 0.95):
        slope = (plan.at(time + step) - plan.at(time - step)) / (2.0 * step)
        assert slope[:2] == pytest.approx(plan.at(time)[1:], abs=1e-5)


def test_past_its_end_it_rests(plan):
    assert np.array_equal(plan.at(5.0), [plan.position[-1], [0.0, 0.0], [0.0, 0.0]])
    assert np.array_equal(plan.at(-1.0), plan.start)


def test_frames_carry_there_and_back():
    rng = np.random.default_rng(0)
    points, pose, now = rng.normal(size=(3, 2)), rng.normal(size=3), rng.normal(size=3)
    there = carried(points, pose, now)
    assert carried(there, now, pose) == pytest.approx(points)
    c, s = np.cos(pose[2]), np.sin(pose[2])
    world = pose[:2] + np.array([[c, -s], [s, c]]) @ points[0]
    c, s = np.cos(now[2]), np.sin(now[2])
    assert now[:2] + np.array([[c, -s], [s, c]]) @ there[0] == pytest.approx(world)


def test_what_is_left_of_a_plan_is_the_same_motion(plan):
    pose, now = np.array([0.1, 0.2, 0.3]), np.array([0.15, 0.1, 0.5])
    for age in (0.0, 0.02, 0.06, 0.5, 0.93):
        later = shifted(plan, age, pose, now)
        assert later.status is Fallback.SHIFTED
        assert later.time[-1] == pytest.approx(plan.time[-1] - age)
        assert later.time[0] > 0.0
        for time in (0.0, 0.01, 0.04, 0.1, 0.7):
            if age + time <= plan.time[-1]:
                wanted = carried(plan.at(age + time), pose, now)
                assert later.at(time) == pytest.approx(wanted, abs=1e-9)
        assert later.zmp - later.position == pytest.approx(
            -CONFIG.height / GRAVITY * later.acceleration, abs=1e-9
        )


def test_the_least_margin_leaves_out_what_is_unknown(plan):
    names = [name for name in ComPlan.__slots__ if name != "margin"]
    values = {name: getattr(plan, name) for name in names}
    some = ComPlan(margin=np.array([np.nan, 0.02, 0.01, np.nan]), **values)
    assert some.least_margin == 0.01
    assert np.isnan(ComPlan(margin=np.full(4, np.nan), **values).least_margin)
