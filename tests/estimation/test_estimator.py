import dataclasses
import math

import numpy as np
import pytest

from bluefoot_mpc.estimation import Estimator, EstimatorConfig, HeadingConfig
from bluefoot_mpc.geometry import rotation_from_quaternion, rotation_from_rpy, rpy_from_rotation
from bluefoot_mpc.settings import build, to_table
from bluefoot_mpc.types import BodyState, SensorFrame

from .synthetic_motion import PERFECT, Motion, Run, Sensors, geometry, make_run

SEEDS = range(4)
START = Motion().start


def estimate(run: Run, config: EstimatorConfig | None = None) -> tuple[Estimator, list[BodyState]]:
    estimator = Estimator(geometry(), config or EstimatorConfig())
    return estimator, [estimator.step(frame) for frame in run.frames]


def tilt_error(run: Run, states: list[BodyState]) -> np.ndarray:
    """(n, 2) degrees, roll and pitch, while walking."""
    rpy = np.array([state.rpy for state in states])
    return np.degrees(rpy - run.rpy)[run.time > START, :2]


def yaw_error(run: Run, states: list[BodyState]) -> np.ndarray:
    """(n,) degrees."""
    yaw = np.array([state.rpy[2] for state in states]) - run.rpy[:, 2]
    return np.degrees((yaw + math.pi) % (2 * math.pi) - math.pi)


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def finite(state: BodyState) -> bool:
    return all(np.isfinite(getattr(state, f.name)).all() for f in dataclasses.fields(state))


@pytest.fixture(scope="module")
def walks() -> list[tuple[Run, Estimator, list[BodyState]]]:
    """Trot at 100 mm/s turning at 0.2 rad/s after 3 s at rest, sensors as specified."""
    runs = [make_run(Motion(duration=23.0), Sensors(), seed) for seed in SEEDS]
    return [(run, *estimate(run)) for run in runs]


def test_attitude_while_walking_and_turning(walks):
    errors = [rms(tilt_error(run, states)) for run, _, states in walks]
    # The accelerometer's bias, seen at rest, is up to 0.18° of each angle and cannot be known.
    assert max(errors) < 0.2
    spread = [tilt_error(run, states).std(axis=0).max() for run, _, states in walks]
    assert max(spread) < 0.1


def test_gyro_bias_is_found(walks):
    for run, estimator, _ in walks:
        np.testing.assert_allclose(estimator.gyro_bias, run.gyro_bias, atol=0.002)


def test_velocity_and_way(walks):
    for run, _, states in walks:
        walking = run.time > START + 1.0
        velocity = np.array([state.linear_velocity for state in states])[walking]
        truth = run.velocity_in_base[walking]
        assert velocity[:, 0].mean() == pytest.approx(truth[:, 0].mean(), rel=0.01)
        assert rms(velocity - truth) < 0.005
        way = states[-1].position - states[0].position - (run.position[-1] - run.position[0])
        assert np.abs(way).max() < 0.03


def test_height_is_above_the_foot_points(walks):
    for run, _, states in walks:
        height = np.array([state.height for state in states])
        assert rms(height - run.position[:, 2]) < 0.001
        assert states[0].position[2] == pytest.approx(run.position[0, 2], abs=0.001)
        np.testing.assert_allclose(states[0].position[:2], 0.0, atol=1e-12)


def test_angular_velocity_has_its_bias_removed(walks):
    for run, _, states in walks:
        rate = np.array([state.angular_velocity for state in states])
        assert np.abs((rate - run.rate)[run.time > START].mean(axis=0)).max() < 0.002


def test_yaw_stays_bounded(walks):
    for run, _, states in walks:
        assert np.abs(yaw_error(run, states)).max() < 3.0


def test_quaternion_and_rpy_are_the_same_rotation(walks):
    for state in walks[0][2][::100]:
        rotation = rotation_from_quaternion(state.quaternion)
        np.testing.assert_allclose(state.rpy, rpy_from_rotation(rotation), atol=1e-9)


def test_perfect_sensors_give_a_perfect_estimate():
    run = make_run(Motion(duration=10.0), PERFECT, 0)
    _, states = estimate(run)
    assert rms(tilt_error(run, states)) < 0.01
    velocity = np.array([state.linear_velocity for state in states])
    assert rms(velocity - run.velocity_in_base) < 0.001
    assert np.abs(states[-1].position - run.position[-1]).max() < 0.002


def complementary(run: Run, time_constant: float) -> np.ndarray:
    """(n, 2) degrees: error of a gyro and accelerometer filter with the gyro's bias known."""
    roll, pitch = run.rpy[0, :2]
    errors = []
    share = 0.02 / time_constant
    for k, frame in enumerate(run.frames):
        rate = frame.imu.gyro.mean(axis=0) - run.gyro_bias
        force = frame.imu.accel.mean(axis=0)
        roll = (1 - share) * (roll + 0.02 * rate[0]) + share * math.atan2(force[1], force[2])
        pitch = (1 - share) * (pitch + 0.02 * rate[1]) + share * math.atan2(-force[0], force[2])
        errors.append((roll - run.rpy[k, 0], pitch - run.rpy[k, 1]))
    return np.degrees(errors)


def test_accelerating_leaves_no_bias_where_an_accelerometer_filter_would():
    # Half a g's hundredth for 1.5 s, to 200 mm/s: the worst of a second after it.
    motion = Motion(duration=8.0, speed=0.2, yaw_rate=0.0, ramp=0.6, cycle=0.3, height=0.11)
    after = slice(round((START + 0.3) / 0.02), round((START + 1.3) / 0.02))
    before = slice(round((START - 1.0) / 0.02), round(START / 0.02))
    for seed in SEEDS:
        run = make_run(motion, Sensors(), seed)
        _, states = estimate(run)
        ours = np.degrees(np.array([s.rpy for s in states]) - run.rpy)[:, 1]
        theirs = complementary(run, 1.0)[:, 1]
        changes = [abs(e[after].mean() - e[before].mean()) for e in (ours, theirs)]
        assert changes[0] < 0.1
        assert changes[1] > 0.25


def test_rolling_feet_do_not_bias_the_speed():
    motion = Motion(duration=10.0, ankle_swing=0.3, yaw_rate=0.0)
    run = make_run(motion, Sensors(), 1)
    _, states = estimate(run)
    walking = run.time > START + 1.0
    truth = run.velocity_in_base[walking, 0].mean()
    velocity = np.array([s.linear_velocity for s in states])[walking, 0].mean()
    assert velocity == pytest.approx(truth, rel=0.02)
    # Without the ball it would be wrong by its radius per angle.
    rigid = dataclasses.replace(geometry(), foot_radius=1e-9)
    estimator = Estimator(rigid, EstimatorConfig())
    without = np.array([estimator.step(f).linear_velocity for f in run.frames])[walking, 0].mean()
    assert abs(without / truth - 1.0) > 0.03


def test_slipping_feet_are_survived():
    run = make_run(Motion(duration=15.0), Sensors(slip=0.004), 3)
    _, states = estimate(run)
    assert rms(tilt_error(run, states)) < 0.25


def test_a_tilted_start_is_found():
    motion = Motion(duration=4.0, start=10.0, start_tilt=(math.radians(6.0), math.radians(-4.0)))
    run = make_run(motion, Sensors(), 0)
    _, states = estimate(run)
    np.testing.assert_allclose(np.degrees(states[50].rpy[:2]), [6.0, -4.0], atol=0.4)
    assert states[-1].healthy
    assert rms(np.array([s.linear_velocity for s in states[50:]])) < 0.005


def test_yaw_without_the_magnetometer_follows_the_gyro():
    run = make_run(Motion(duration=15.0), Sensors(hard_iron=0.0), 2)
    _, free = estimate(run, EstimatorConfig(heading=HeadingConfig(enabled=False)))
    assert np.abs(yaw_error(run, free)).max() < 1.0


def test_magnetometer_bounds_a_yaw_that_would_drift():
    # Feet in the air: nothing but the magnetometer shows the bias about the vertical.
    run = make_run(Motion(duration=25.0, start=60.0), Sensors(), 0)
    frames = [dataclasses.replace(f, contact=np.zeros(4, dtype=bool)) for f in run.frames]
    run = dataclasses.replace(run, frames=frames)
    _, free = estimate(run, EstimatorConfig(heading=HeadingConfig(enabled=False)))
    held_by, held = estimate(run)
    assert np.abs(yaw_error(run, held)).max() < 3.0
    assert np.abs(yaw_error(run, free)).max() > 10.0
    assert held_by.gyro_bias[2] == pytest.approx(run.gyro_bias[2], abs=0.003)


def test_reset_is_bit_for_bit():
    run = make_run(Motion(duration=5.0), Sensors(), 0)
    estimator, first = estimate(run)
    estimator.reset()
    again = [estimator.step(frame) for frame in run.frames]
    for a, b in zip(first, again, strict=True):
        for f in dataclasses.fields(BodyState):
            np.testing.assert_array_equal(getattr(a, f.name), getattr(b, f.name))


def test_frames_are_not_changed_and_states_are_not_shared():
    run = make_run(Motion(duration=1.0), Sensors(), 0)
    copies = [frame.joint_position.copy() for frame in run.frames]
    _, states = estimate(run)
    for frame, copy in zip(run.frames, copies, strict=True):
        np.testing.assert_array_equal(frame.joint_position, copy)
    assert not np.shares_memory(states[-1].joint_position, run.frames[-1].joint_position)


@pytest.fixture(scope="module")
def run() -> Run:
    return make_run(Motion(duration=10.0), Sensors(), 0)


class TestFaults:
    """Whatever breaks, the estimate stays finite and says so."""

    def broken(self, run: Run, change, first: int = 200, last: int = 300) -> list[BodyState]:
        frames = [change(f) if first <= k < last else f for k, f in enumerate(run.frames)]
        estimator = Estimator(geometry(), EstimatorConfig())
        states = [estimator.step(frame) for frame in frames]
        assert all(finite(state) for state in states)
        return states

    def test_silent_imu(self, run):
        def change(frame: SensorFrame) -> SensorFrame:
            imu = frame.imu
            empty = type(imu)(
                time=imu.time[:0], gyro=imu.gyro[:0], accel=imu.accel[:0],
                magnetometer=imu.magnetometer[:0], valid=imu.valid[:0],
            )  # fmt: skip
            return dataclasses.replace(frame, imu=empty)

        states = self.broken(run, change)
        assert states[203].healthy
        assert not states[210].healthy
        assert states[310].healthy
        # Feet alone carry the attitude meanwhile, and it comes back afterwards.
        error = np.degrees(np.array([s.rpy for s in states]) - run.rpy)[:, :2]
        assert np.abs(error[200:300]).max() < 8.0
        assert rms(error[450:]) < 0.5

    @pytest.mark.parametrize("what", ["nan", "invalid", "frozen", "other clock"])
    def test_useless_imu_samples(self, run, what):
        def change(frame: SensorFrame) -> SensorFrame:
            imu = frame.imu
            values = {
                "nan": {"gyro": np.full_like(imu.gyro, np.nan)},
                "invalid": {"valid": np.zeros(4, dtype=bool)},
                "frozen": {"gyro": np.full_like(imu.gyro, 0.1), "accel": np.full_like(imu.accel, 5.0)},
                "other clock": {"time": imu.time + 1000.0},
            }[what]
            return dataclasses.replace(frame, imu=dataclasses.replace(imu, **values))

        states = self.broken(run, change)
        assert not states[210].healthy
        assert states[310].healthy
        error = np.degrees(np.array([s.rpy for s in states]) - run.rpy)[:, :2]
        assert rms(error[450:]) < 0.5

    def test_one_bad_sample_is_not_even_noticed(self, run):
        def change(frame: SensorFrame) -> SensorFrame:
            gyro = frame.imu.gyro.copy()
            gyro[1] = np.inf
            return dataclasses.replace(frame, imu=dataclasses.replace(frame.imu, gyro=gyro))

        states = self.broken(run, change)
        assert all(state.healthy for state in states)
        assert rms(np.degrees(np.array([s.rpy for s in states]) - run.rpy)[150:, :2]) < 0.3

    def test_dropped_joints(self, run):
        rng = np.random.default_rng(0)

        def change(frame: SensorFrame) -> SensorFrame:
            valid = rng.random(16) > 0.1
            position = np.where(valid, frame.joint_position, np.nan)
            return dataclasses.replace(frame, joint_position=position, joint_valid=valid)

        states = self.broken(run, change)
        assert all(state.healthy for state in states)
        assert rms(np.degrees(np.array([s.rpy for s in states]) - run.rpy)[150:, :2]) < 0.4

    def test_all_joints_lost(self, run):
        states = self.broken(run, lambda f: dataclasses.replace(f, joint_valid=np.zeros(16, dtype=bool)))
        assert not states[250].healthy
        assert states[310].healthy
        assert np.abs(states[299].linear_velocity).max() < 1.0

    @pytest.mark.parametrize("jump", [5.0, -3.0, 0.0])
    def test_time_jump(self, run, jump):
        def change(frame: SensorFrame) -> SensorFrame:
            if jump == 0.0:
                return dataclasses.replace(run.frames[200], contact=frame.contact)
            imu = dataclasses.replace(frame.imu, time=frame.imu.time + jump)
            return dataclasses.replace(frame, time=frame.time + jump, imu=imu)

        states = self.broken(run, change, last=len(run.frames) if jump else 240)
        assert not states[200 if jump else 201].healthy
        assert states[-1].healthy
        error = np.degrees(np.array([s.rpy for s in states]) - run.rpy)[-100:, :2]
        assert rms(error) < 0.5
        velocity = np.array([s.linear_velocity for s in states])[-100:]
        assert rms(velocity - run.velocity_in_base[-100:]) < 0.02

    @pytest.mark.parametrize("value", [True, False])
    def test_stuck_switch(self, run, value):
        def change(frame: SensorFrame) -> SensorFrame:
            contact = frame.contact.copy()
            contact[1] = value
            return dataclasses.replace(frame, contact=contact)

        states = self.broken(run, change, last=len(run.frames))
        error = np.degrees(np.array([s.rpy for s in states]) - run.rpy)[200:, :2]
        assert rms(error) < 0.5
        velocity = np.array([s.linear_velocity for s in states])[250:, 0].mean()
        assert velocity == pytest.approx(run.velocity_in_base[250:, 0].mean(), rel=0.1)

    def test_chattering_switches(self, run):
        rng = np.random.default_rng(3)
        states = self.broken(run, lambda f: dataclasses.replace(f, contact=f.contact ^ (rng.random(4) < 0.3)))
        assert rms(np.degrees(np.array([s.rpy for s in states]) - run.rpy)[150:, :2]) < 0.5

    def test_broken_switches_are_not_used(self, run):
        states = self.broken(
            run, lambda f: dataclasses.replace(f, contact_valid=np.zeros(4, dtype=bool)), last=260
        )
        assert not states[240].contact.any()
        assert np.abs(states[259].linear_velocity).max() < 1.0

    def test_nothing_at_all_from_the_first_frame_on(self, run):
        def change(frame: SensorFrame) -> SensorFrame:
            imu = dataclasses.replace(frame.imu, valid=np.zeros(4, dtype=bool))
            nothing = np.full(16, np.nan)
            return dataclasses.replace(
                frame, imu=imu, joint_position=nothing, joint_valid=np.zeros(16, dtype=bool),
                contact=np.zeros(4, dtype=bool),
            )  # fmt: skip

        states = self.broken(run, change, first=0)
        assert not states[100].healthy


def test_on_its_belly_the_accelerometer_still_gives_the_tilt():
    motion = Motion(duration=20.0, start=30.0, start_tilt=(0.1, 0.05))
    run = make_run(motion, Sensors(), 1)
    frames = [dataclasses.replace(f, contact=np.zeros(4, dtype=bool)) for f in run.frames]
    estimator = Estimator(geometry(), EstimatorConfig())
    states = [estimator.step(frame) for frame in frames]
    error = np.degrees(np.array([s.rpy for s in states]) - run.rpy)[200:, :2]
    assert np.abs(error).max() < 1.0
    assert np.abs(states[-1].linear_velocity).max() < 0.2


def test_a_wrong_velocity_is_found_again():
    # A blow that saturates the accelerometer: the filter must not lock its feet out for good.
    run = make_run(Motion(duration=8.0), Sensors(), 1)

    def hit(frame: SensorFrame) -> SensorFrame:
        accel = frame.imu.accel + np.array([30.0, 0.0, 20.0])
        return dataclasses.replace(frame, imu=dataclasses.replace(frame.imu, accel=accel))

    estimator = Estimator(geometry(), EstimatorConfig())
    states = [estimator.step(hit(f) if 200 <= k < 205 else f) for k, f in enumerate(run.frames)]
    velocity = np.array([s.linear_velocity for s in states])
    assert rms((velocity - run.velocity_in_base)[250:]) < 0.03


def test_config_survives_a_table():
    config = EstimatorConfig()
    assert build(EstimatorConfig, to_table(config)) == config


def test_mount_above_the_trunk_does_not_matter():
    # The same truth at the trunk origin, whatever the lever arm of the IMU.
    run = make_run(Motion(duration=6.0), PERFECT, 0)
    wrong = dataclasses.replace(EstimatorConfig().imu, mount=(0.0, 0.0, 0.12))
    _, right_states = estimate(run)
    _, wrong_states = estimate(run, dataclasses.replace(EstimatorConfig(), imu=wrong))
    errors = [
        rms(np.array([s.linear_velocity for s in states])[200:] - run.velocity_in_base[200:])
        for states in (right_states, wrong_states)
    ]
    assert errors[0] < 0.001
    assert errors[1] > 3.0 * errors[0]


def test_synthetic_rotation_is_the_shared_one():
    run = make_run(Motion(duration=5.0), PERFECT, 0)
    k = 200
    down = rotation_from_rpy(run.rpy[k]).T @ np.array([0.0, 0.0, 9.80665])
    force = run.frames[k].imu.accel[-1]
    assert np.abs(force - down).max() < 1.0


@pytest.mark.parametrize("lag", [0.003, 0.007, 0.012])
def test_samples_that_are_on_their_way_for_a_while_change_nothing(lag):
    """A board's newest sample is older than its frame; joints and switches are as they were."""
    run = make_run(Motion(duration=6.0), Sensors(), 0)
    estimator, late = Estimator(geometry(), EstimatorConfig()), Estimator(geometry(), EstimatorConfig())
    for frame in run.frames:
        expected = estimator.step(frame)
        seen = late.step(dataclasses.replace(frame, time=frame.time + lag))
        np.testing.assert_allclose(seen.rpy, expected.rpy, atol=1e-9)
        np.testing.assert_allclose(seen.linear_velocity, expected.linear_velocity, atol=1e-9)
