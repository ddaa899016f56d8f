"""Plans: dynamics, constraints, frames, memory, and the ladder when something fails."""

import dataclasses

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.qp import QpSolution, QpStatus, SolverOptions, make_solver
from bluefoot_mpc.types import Fallback
from bluefoot_mpc.zmp.preview import PreviewConfig, PreviewController, PreviewWeights
from bluefoot_mpc.zmp.preview.model import advance
from bluefoot_mpc.zmp.preview.plan import carried
from bluefoot_mpc.zmp.preview.program import sizes
from bluefoot_mpc.zmp.support import SupportConfig
from tests.zmp.preview import scenes

CONFIG = PreviewConfig(samples=16, interval=0.06)
DT = 0.02
REST = np.zeros((3, 2))
ARRAYS = ("start", "position", "velocity", "acceleration", "jerk", "zmp")


@pytest.fixture(scope="module")
def shared():
    return PreviewController(CONFIG)


@pytest.fixture
def controller(shared):
    shared.reset()
    return shared


class Switched:
    """A real backend that can be told to fail."""

    def __init__(self, size):
        self._solver, self.fails = make_solver("daqp", size, SolverOptions(warm_start=False)), None

    def solve(self, problem):
        if self.fails is None:
            return self._solver.solve(problem)
        return QpSolution(x=np.full(problem.size.variables, np.nan), status=self.fails)

    def reset(self):
        self._solver.reset()


def switched(config=CONFIG):
    solvers = tuple(Switched(size) for size in sizes(config))
    return PreviewController(config, solvers), solvers


def hard(phase=0.1, **others):
    """Inputs whose unconstrained optimum breaks rows."""
    return scenes.inputs(scenes.walk(CONFIG, phase), **{"state": pushed(), **others})


def pushed():
    return np.array([[0.004, 0.002], [0.06, -0.05], [0.0, 0.0]])


def sane(plan):
    """No plan may ever hold a number that is none, or jump away."""
    assert all(np.isfinite(getattr(plan, name)).all() for name in ARRAYS)
    assert np.abs(plan.position).max() < 0.5
    assert np.abs(plan.acceleration).max() < 20.0
    assert not np.isinf([*plan.margin, *plan.slack]).any()


def test_samples_follow_from_start_and_jerks(controller):
    plan = controller.step(hard(), DT)
    state = plan.start
    for k, jerk in enumerate(plan.jerk):
        state = advance(state, jerk, CONFIG.interval)
        assert np.array(state) == pytest.approx(
            np.array([plan.position[k], plan.velocity[k], plan.acceleration[k]]), abs=1e-9
        )
    assert plan.zmp == pytest.approx(plan.position - CONFIG.height / GRAVITY * plan.acceleration, abs=1e-12)
    assert plan.time[0] == CONFIG.interval


def test_a_plan_that_meets_nothing_needs_no_solver():
    controller, _ = switched()
    schedule = dataclasses.replace(scenes.walk(CONFIG), stance=np.ones((16, 4), dtype=bool))
    plan = controller.step(scenes.inputs(schedule, speed=0.0, state=REST), DT)
    assert plan.status is Fallback.SOLVED
    assert plan.iterations == 0
    assert np.abs(plan.position).max() < 1e-12


@pytest.mark.parametrize("gait", [scenes.walk, scenes.trot])
@pytest.mark.parametrize("phase", [0.05, 0.3, 0.61, 0.95])
def test_rows_hold_but_for_the_slack_told(controller, gait, phase):
    plan = controller.step(scenes.inputs(gait(CONFIG, phase), state=REST), DT)
    assert plan.status is Fallback.SOLVED
    assert plan.slack.max() < 1e-3
    three = gait is scenes.walk
    if three:
        assert plan.margin.min() >= CONFIG.support.margin - plan.slack[0] - 1e-9
        assert plan.least_margin == plan.margin.min()
    else:
        assert plan.margin.min() >= -CONFIG.support.half_width - plan.slack[0] - 1e-9


def test_reach_bounds_the_motion():
    schedule = scenes.walk(CONFIG, 0.1)
    pull = dataclasses.replace(CONFIG, centre_pull=1.0, reach=(0.012, 0.012))
    plan = PreviewController(pull).step(scenes.inputs(schedule, speed=0.0, state=REST), DT)
    free = PreviewController(dataclasses.replace(pull, reach=(0.2, 0.2))).step(
        scenes.inputs(schedule, speed=0.0, state=REST), DT
    )
    assert np.abs(plan.position).max() <= 0.012 + plan.slack[1]
    assert plan.slack[1] < 1e-3
    assert np.abs(free.position).max() > 0.03
    other = PreviewController(pull).step(
        scenes.inputs(schedule, speed=0.0, state=REST, reach=np.full((16, 2), 0.02)), DT
    )
    assert 0.012 < np.abs(other.position).max() <= 0.02 + other.slack[1]


def test_the_capture_point_ends_in_the_last_region(controller):
    schedule = scenes.walk(CONFIG, 0.1)
    leap = np.array([[0.0, 0.0], [0.25, 0.25], [0.0, 0.0]])
    plan = controller.step(scenes.inputs(schedule, state=leap), DT)
    capture = plan.position[-1] + np.sqrt(CONFIG.height / GRAVITY) * plan.velocity[-1]
    distance = controller._problem.normals[-4:] @ capture - controller._problem._offsets[15]
    assert distance.max() == pytest.approx(plan.slack[2], abs=1e-9) or distance.max() < 0.0


def test_a_height_that_changes_moves_the_zmp(controller):
    schedule = scenes.walk(CONFIG, 0.1)
    height = np.linspace(0.08, 0.12, 16)
    rise = np.linspace(-1.0, 1.0, 16)
    plan = controller.step(scenes.inputs(schedule, state=pushed(), height=height, rise=rise), DT)
    lever = height / (GRAVITY + rise)
    assert plan.zmp == pytest.approx(plan.position - lever[:, None] * plan.acceleration, abs=1e-12)
    assert plan.margin.min() >= CONFIG.support.margin - plan.slack[0] - 1e-9


def test_gravity_along_a_tilted_plan_is_balanced(controller):
    tilt = 0.1
    gravity = GRAVITY * np.array([np.sin(tilt), 0.0, -np.cos(tilt)])
    schedule = dataclasses.replace(scenes.walk(CONFIG), stance=np.ones((16, 4), dtype=bool))
    plan = controller.step(scenes.inputs(schedule, speed=0.0, state=REST, gravity=gravity), DT)
    lever = CONFIG.height / (GRAVITY * np.cos(tilt))
    assert plan.zmp == pytest.approx(plan.position - lever * (plan.acceleration - gravity[:2]), abs=1e-12)
    # The centre of mass moves uphill, so that the ZMP comes back under the wanted place.
    assert plan.position[-1, 0] < -0.003


def test_plans_turn_and_move_with_everything(controller):
    yaw, offset = 0.8, np.array([1.5, -0.7])
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array([[c, -s], [s, c]])
    plain = hard()
    plan = controller.step(plain, DT)
    controller.reset()
    schedule = plain.schedule
    feet = schedule.footholds.copy()
    feet[:, :, :2] = feet[:, :, :2] @ turn.T + offset
    state = plain.state @ turn.T
    state[0] += offset
    moved = controller.step(
        dataclasses.replace(
            plain,
            schedule=dataclasses.replace(schedule, footholds=feet),
            nominal=plain.nominal @ turn.T + offset,
            state=state,
            heading=np.full(16, yaw),
        ),
        DT,
    )
    assert plan.iterations > 0
    assert moved.position == pytest.approx(plan.position @ turn.T + offset, abs=1e-7)
    assert moved.zmp == pytest.approx(plan.zmp @ turn.T + offset, abs=1e-7)
    assert moved.margin == pytest.approx(plan.margin, abs=1e-7)


def test_plans_are_mirrored_with_everything(controller):
    plain = hard()
    plan = controller.step(plain, DT)
    mirror, swap = np.array([1.0, -1.0]), [1, 0, 3, 2]
    schedule = plain.schedule
    feet = schedule.footholds[:, swap] * np.array([1.0, -1.0, 1.0])
    other = controller.step(
        dataclasses.replace(
            plain,
            schedule=dataclasses.replace(schedule, footholds=feet, stance=schedule.stance[:, swap]),
            nominal=plain.nominal * mirror,
            state=plain.state * mirror,
        ),
        DT,
    )
    assert other.position == pytest.approx(plan.position * mirror, abs=1e-7)


def test_the_next_plan_starts_where_the_last_one_wants_to_be(controller):
    first = controller.step(hard(pose=np.array([0.0, 0.0, 0.0])), DT)
    pose = np.array([0.01, 0.005, 0.1])
    second = controller.step(hard(state=None, pose=pose), DT)
    assert second.start == pytest.approx(carried(first.at(DT), np.zeros(3), pose), abs=1e-12)


def test_reset_is_the_state_after_init_bit_for_bit():
    used, fresh = PreviewController(CONFIG), PreviewController(CONFIG)
    rng = np.random.default_rng(0)
    for phase in rng.random(5):
        used.step(scenes.inputs(scenes.walk(CONFIG, phase), state=scenes.state(rng, 2.0)), DT)
    used.step(hard(state=np.full((3, 2), np.nan)), DT)
    used.reset()
    for phase in (0.1, 0.12, 0.14):
        a = used.step(scenes.inputs(scenes.walk(CONFIG, phase)), DT)
        b = fresh.step(scenes.inputs(scenes.walk(CONFIG, phase)), DT)
        assert all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ARRAYS)
        assert (a.status, a.iterations) == (b.status, b.iterations)


def test_a_plan_outlives_the_next_one(controller):
    first = controller.step(hard(), DT)
    kept = {name: getattr(first, name).copy() for name in (*ARRAYS, "margin", "slack", "supported")}
    controller.step(scenes.inputs(scenes.walk(CONFIG, 0.7), state=-pushed()), DT)
    assert all(np.array_equal(getattr(first, name), value) for name, value in kept.items())


# The ladder.


@pytest.mark.parametrize("status", [QpStatus.INFEASIBLE, QpStatus.MAX_ITERATIONS, QpStatus.FAILED])
def test_without_a_solver_the_nearest_plan_is_used(status):
    controller, solvers = switched()
    best = controller.step(hard(), DT)
    assert best.iterations > 0
    for solver in solvers:
        solver.fails = status
    controller.reset()
    plan = controller.step(hard(), DT)
    assert plan.status is Fallback.NEAREST
    sane(plan)
    assert plan.slack.max() < CONFIG.nearest_violation
    assert plan.position == pytest.approx(best.position, abs=2e-3)


def test_an_answer_that_is_no_number_is_never_used():
    controller, solvers = switched()
    for solver in solvers:
        solver.fails = QpStatus.SOLVED  # with an x of NaN
    plan = controller.step(hard(), DT)
    assert plan.status is Fallback.NEAREST
    sane(plan)


def test_then_the_last_plan_goes_on_for_a_while_and_then_the_way_to_the_feet():
    config = dataclasses.replace(CONFIG, nearest_violation=1e-9)
    controller, solvers = switched(config)
    first = controller.step(hard(), DT)
    for solver in solvers:
        solver.fails = QpStatus.FAILED
    statuses, clock = [], 0.0
    for _ in range(60):
        clock += DT
        pose = np.array([0.5 * clock, -0.1 * clock, 0.3 * clock])
        plan = controller.step(hard(pose=pose), DT)
        sane(plan)
        statuses.append(plan.status)
        if plan.status is Fallback.SHIFTED:
            for time in (0.0, 0.05, 0.13):
                wanted = carried(first.at(clock + time), np.zeros(3), pose)
                rest = clock + time > first.time[-1] + 1e-9
                assert rest or plan.at(time) == pytest.approx(wanted, abs=2e-3)
            assert plan.at(0.0) == pytest.approx(carried(first.at(clock), np.zeros(3), pose), abs=1e-9)
    lasted = statuses.count(Fallback.SHIFTED)
    assert statuses == [Fallback.SHIFTED] * lasted + [Fallback.STANCE] * (60 - lasted)
    assert (lasted + 1) * DT == pytest.approx(CONFIG.shift_time, abs=DT)


def test_the_way_to_the_feet_is_slow_and_arrives():
    controller, solvers = switched(dataclasses.replace(CONFIG, nearest_violation=1e-9))
    for solver in solvers:
        solver.fails = QpStatus.FAILED
    state = np.array([[0.05, -0.03], [0.0, 0.0], [0.0, 0.0]])
    stance = np.ones((16, 4), dtype=bool)
    stance[:, 0] = False
    schedule = dataclasses.replace(scenes.walk(CONFIG), stance=stance)
    goal = schedule.footholds[0, 1:, :2].mean(axis=0)
    for _ in range(200):
        plan = controller.step(scenes.inputs(schedule, state=state), DT)
        sane(plan)
        assert np.linalg.norm(plan.velocity, axis=1).max() < 3.0 * CONFIG.stance_speed
        state = plan.at(DT)
        if plan.status is Fallback.SOLVED:
            break
    assert np.linalg.norm(state[0] - goal) < 0.06


@pytest.mark.parametrize("field", ["nominal", "state", "footholds", "height", "pose", "gravity", "zmp"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_no_number_goes_to_the_ladder(controller, field, value):
    rung = []
    for known in (False, True):
        controller.reset()
        if known:
            controller.step(hard(), DT)
        inputs = hard()
        if field == "footholds":
            feet = inputs.schedule.footholds.copy()
            feet[3, 1, 0] = value
            inputs = dataclasses.replace(
                inputs, schedule=dataclasses.replace(inputs.schedule, footholds=feet)
            )
        else:
            shape = {
                "nominal": (16, 2),
                "state": (3, 2),
                "height": 16,
                "pose": 3,
                "gravity": 3,
                "zmp": (16, 2),
            }
            bad = np.array(
                getattr(inputs, field) if field in ("nominal", "state") else np.full(shape[field], 0.1)
            )
            bad.flat[1] = value
            inputs = dataclasses.replace(inputs, **{field: bad})
        plan = controller.step(inputs, DT)
        sane(plan)
        rung.append(plan.status)
    # Where b' stands does not matter to a plan of its own.
    assert rung == ([Fallback.SOLVED] * 2 if field == "pose" else [Fallback.STANCE, Fallback.SHIFTED])
    assert controller.step(hard(), DT).status is Fallback.SOLVED


@pytest.mark.parametrize("height", [-0.1, 0.0])
def test_a_height_that_cannot_be_goes_to_the_ladder(controller, height):
    plan = controller.step(hard(height=height), DT)
    assert plan.status is Fallback.STANCE
    sane(plan)


def test_a_schedule_without_any_foot_goes_to_the_ladder(controller):
    schedule = dataclasses.replace(scenes.walk(CONFIG), stance=np.zeros((16, 4), dtype=bool))
    plan = controller.step(scenes.inputs(schedule, state=REST), DT)
    assert plan.status is Fallback.STANCE
    assert not plan.supported.any()
    assert np.isnan([*plan.margin, plan.least_margin]).all()
    sane(plan)
    controller.step(hard(), DT)
    assert controller.step(scenes.inputs(schedule), DT).status is Fallback.SHIFTED


def test_a_moment_without_a_foot_is_flagged(controller):
    schedule = scenes.walk(CONFIG)
    schedule.stance[4:6] = False
    plan = controller.step(scenes.inputs(schedule, state=REST), DT)
    assert plan.status is Fallback.SOLVED
    assert np.flatnonzero(~plan.supported).tolist() == [4, 5]


def test_a_margin_beyond_the_support_shrinks_it_to_its_middle():
    config = dataclasses.replace(CONFIG, support=SupportConfig(margin=1.0), reach=(0.2, 0.2))
    plan = PreviewController(config).step(scenes.inputs(scenes.walk(config, 0.1), state=REST), DT)
    assert plan.status is Fallback.SOLVED
    sane(plan)


def test_a_far_start_is_brought_back_without_failing():
    controller = PreviewController(CONFIG)
    rng = np.random.default_rng(4)
    for scale in (10.0, 30.0, 100.0):
        for _ in range(10):
            plan = controller.step(
                scenes.inputs(scenes.walk(CONFIG, rng.random()), state=scenes.state(rng, scale)), DT
            )
            assert plan.status is Fallback.SOLVED
            assert plan.slack.max() > 0.0


# What cannot be.


def test_names_and_numbers_are_checked():
    with pytest.raises(UnknownNameError, match="preview law.*kajita"):
        PreviewConfig(law="kajta")
    with pytest.raises(UnknownNameError, match="solver.*daqp"):
        PreviewController(PreviewConfig(solver="daqq"))
    for wrong in (
        {"height": -0.1}, {"interval": 0.0}, {"samples": 1}, {"rounds": 0}, {"rows": ()},
        {"rows": (8, 8)}, {"centre_pull": 1.1}, {"depth": -1e-3}, {"reach": (0.0, 0.1)},
    ):  # fmt: skip
        with pytest.raises(ConfigurationError, match=next(iter(wrong))):
            PreviewConfig(**wrong)
    with pytest.raises(ConfigurationError, match="jerk"):
        PreviewWeights(jerk=0.0)
    with pytest.raises(ConfigurationError, match="zmp and position"):
        PreviewWeights(zmp=0.0, position=0.0)


def test_schedules_of_another_grid_are_refused(controller):
    other = dataclasses.replace(CONFIG, samples=8)
    with pytest.raises(ConfigurationError, match="16 samples.*8"):
        controller.step(scenes.inputs(scenes.walk(other)), DT)
    finer = dataclasses.replace(CONFIG, interval=0.02)
    with pytest.raises(ConfigurationError, match=r"0\.96 s ahead.*0\.32"):
        controller.step(scenes.inputs(scenes.walk(finer)), DT)
