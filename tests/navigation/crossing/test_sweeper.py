"""A sweep by a trunk that follows with a lag, over a flat floor; and what may go wrong with it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.geometry import quaternion_from_rpy
from bluefoot_mpc.navigation.crossing.pose_track import PoseTrack
from bluefoot_mpc.navigation.crossing.sweeper import Sweeper, SweepStep
from bluefoot_mpc.terrain.sweep import SweepConfig
from bluefoot_mpc.types import BodyState, ImuBatch, SensorFrame
from tests.terrain.flat_floor import HEIGHT, MOUNTS, floor_scan

DT = 0.02
FEW = SweepConfig(spacing="pitch", count=8)
"""Nine levels."""


def state(time: float, pitch: float, rate: float = 0.0, healthy: bool = True) -> BodyState:
    rpy = np.array([0.0, pitch, 0.0])
    return BodyState(
        time=time, position=np.array([0.0, 0.0, HEIGHT]), quaternion=quaternion_from_rpy(rpy), rpy=rpy,
        linear_velocity=np.zeros(3), angular_velocity=np.array([0.0, rate, 0.0]),
        joint_position=np.zeros(16), joint_velocity=np.zeros(16), contact=np.ones(4, dtype=bool),
        foot_position_in_base=np.zeros((4, 3)), height=HEIGHT, healthy=healthy,
    )  # fmt: skip


def frame(time: float, lidar=None) -> SensorFrame:
    none = np.zeros(0)
    imu = ImuBatch(
        time=none, gyro=np.zeros((0, 3)), accel=np.zeros((0, 3)), magnetometer=np.zeros((0, 3)),
        valid=np.zeros(0, dtype=bool),
    )  # fmt: skip
    zeros, yes = np.zeros(16), np.ones(16, dtype=bool)
    return SensorFrame(
        time=time, joint_position=zeros, joint_speed=zeros, joint_load=zeros, joint_temperature=zeros,
        joint_time=zeros, joint_valid=yes, voltage=12.0, voltage_valid=True, imu=imu,
        contact=np.ones(4, dtype=bool), contact_time=np.zeros(4), contact_valid=np.ones(4, dtype=bool),
        lidar=lidar,
    )  # fmt: skip


class Stand:
    """A trunk that follows with a lag as far as it reaches, and its LIDAR, ten times a second."""

    def __init__(self, config=FEW, reach_deg=90.0, share=0.3):
        self.sweeper = Sweeper(config, MOUNTS)
        self.reach, self.pitch, self.time, self.ticks = math.radians(reach_deg), 0.0, 0.0, 0
        self.share = share  # of the way to the wanted pitch, in a tick
        self.spoil = lambda scan: scan
        self.trust = lambda estimate: estimate

    def tick(self) -> SweepStep:
        estimate = state(self.time, self.pitch)
        scan = None
        if self.ticks % 5 == 0:
            scan = self.spoil(floor_scan(estimate.position, estimate.quaternion, time=self.time))
        step = self.sweeper.step(frame(self.time, scan), self.trust(estimate), DT)
        self.pitch += self.share * (min(step.pitch, self.reach) - self.pitch)
        self.time, self.ticks = self.time + DT, self.ticks + 1
        return step

    def sweep(self, most=60.0) -> list[SweepStep]:
        self.sweeper.begin(self.time)
        steps = [self.tick()]
        while not steps[-1].done and self.time < most:
            steps.append(self.tick())
        return steps


def test_a_sweep_reaches_every_level_and_ends_level():
    stand = Stand()
    steps = stand.sweep()
    assert steps[-1].done
    assert not any(step.done for step in steps[:-1])
    assert (steps[-1].reason, steps[-1].reached, steps[-1].count) == ("", 9, 9)
    assert steps[-1].pitch == 0.0
    assert abs(stand.pitch) < math.radians(FEW.level_deg)
    seen = [step.level for step in steps if step.level >= 0]
    assert sorted(set(seen)) == list(range(9))
    assert seen == sorted(seen)


def test_points_lie_on_the_floor_and_bear_time_and_place_of_their_scan():
    looks = [step for step in Stand().sweep() if len(step.points)]
    assert len(looks) >= 9
    for step in looks:
        np.testing.assert_allclose(step.points[:, 2], 0.0, atol=4e-3)
        assert math.isfinite(step.time)
        assert 0.1 < step.origin[2] < 0.3
    assert all(np.isnan(step.origin).all() for step in Stand().sweep() if not len(step.points))


def test_only_scans_of_a_level_count_where_that_is_wanted():
    config = replace(FEW, dwell_scans=2)
    every = [step for step in Stand(config, share=0.12).sweep() if len(step.points)]
    config = replace(config, use_all_scans=False)
    counted = [step for step in Stand(config, share=0.12).sweep() if len(step.points)]
    assert len(every) > len(counted)
    assert len(counted) == 18


def test_the_default_sweep_takes_about_one_scan_a_level():
    steps = Stand(SweepConfig()).sweep()
    assert not steps[-1].reason
    assert len(steps) * DT < 8.5


def test_levels_out_of_reach_are_given_up_and_said():
    steps = Stand(reach_deg=22.0).sweep()
    assert steps[-1].done
    assert "4 of 9 levels not reached" in steps[-1].reason
    assert "out of reach" in steps[-1].reason
    assert steps[-1].reached == 5
    assert len(steps) * DT < 10.0


def test_a_trunk_that_never_moves_ends_the_sweep():
    steps = Stand(reach_deg=0.0).sweep()
    assert steps[-1].done
    # A plane that stays level meets no ground.
    assert "no echo" in steps[-1].reason
    assert not any(len(step.points) for step in steps)
    assert len(steps) * DT < 6.0


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (lambda scan: None, "none came"),
        (lambda scan: replace(scan, valid=False), "invalid"),
        (lambda scan: replace(scan, time=scan.time - 5.0), "not of now"),
        (lambda scan: replace(scan, time=math.nan), "not of now"),
        (lambda scan: replace(scan, time=0.0), "not newer|not of now"),
        (lambda scan: replace(scan, distance=np.full_like(scan.distance, np.nan)), "no echo"),
        (lambda scan: replace(scan, bearing=scan.bearing * np.nan), "bearings are not numbers"),
        (lambda scan: replace(scan, distance=scan.distance[:-1]), "do not match"),
    ],
)
def test_without_usable_scans_the_sweep_ends_with_the_reason(spoil, reason):
    stand = Stand()
    stand.spoil = spoil
    steps = stand.sweep()
    assert steps[-1].done
    assert steps[-1].reason.startswith("no usable scan")
    assert any(part in steps[-1].reason for part in reason.split("|"))
    assert len(steps) * DT < 4.0
    assert steps[-1].pitch == 0.0


@pytest.mark.parametrize(
    "trust",
    [
        lambda e: replace(e, healthy=False) if e.time > 1.0 else e,
        lambda e: replace(e, rpy=e.rpy * np.nan, quaternion=e.quaternion * np.nan) if e.time > 1.0 else e,
        lambda e: replace(e, position=e.position * np.nan) if e.time > 1.0 else e,
        lambda e: replace(e, healthy=False),
    ],
)
def test_an_estimate_that_is_not_to_be_trusted_ends_the_sweep(trust):
    stand = Stand()
    stand.trust = trust
    steps = stand.sweep()
    assert steps[-1].done
    assert "not to be trusted" in steps[-1].reason
    assert all(math.isfinite(step.pitch) for step in steps)
    assert not any(len(step.points) for step in steps[round(1.1 / DT) :])


def test_a_second_sweep_is_like_the_first_and_a_reset_forgets():
    stand = Stand()
    first = [step.pitch for step in stand.sweep()]
    again = Stand()
    assert [step.pitch for step in again.sweep()] == first
    again.sweeper.reset()
    idle = again.tick()
    assert idle.done
    assert idle.reason == "no sweep was begun"
    later = again.sweep(most=again.time + 60.0)
    assert not later[-1].reason
    assert later[-1].reached == 9


def test_the_trunk_is_shifted_as_configured_while_it_sweeps_only():
    steps = Stand(replace(FEW, forward=-0.01, raised=0.005)).sweep()
    assert steps[10].trunk.position.tolist() == [-0.01, 0.0, 0.005]
    assert steps[-1].trunk.position.tolist() == [0.0, 0.0, 0.0]


def test_a_pose_between_two_ticks_is_on_the_way_between_them():
    track = PoseTrack()
    for k, pitch in enumerate((0.1, 0.2, 0.4)):
        track.add(state(k * DT, pitch, rate=-pitch))
    assert track.at(1.5 * DT).pitch == pytest.approx(0.3, abs=1e-9)
    assert track.at(1.5 * DT).rate == pytest.approx(0.3)
    assert track.at(DT).pitch == pytest.approx(0.2)
    assert track.at(-1.0).pitch == pytest.approx(0.1)
    assert track.at(9.0).pitch == pytest.approx(0.4)


def test_a_scan_during_which_the_trunk_turned_fast_does_not_count():
    stand = Stand()
    stand.trust = lambda e: replace(e, angular_velocity=np.array([0.0, 0.2, 0.0]))
    steps = stand.sweep()
    assert "levels not reached" in steps[-1].reason
    assert not any(len(step.points) for step in steps)


def test_a_scan_that_comes_twice_counts_once():
    stand = Stand(replace(FEW, dwell_scans=3))
    kept = []

    def twice(scan):
        kept.append(scan)
        return kept[-2] if len(kept) % 2 == 0 else scan

    stand.spoil = twice
    times = [step.time for step in stand.sweep() if len(step.points)]
    assert len(times) > 3
    assert len(times) == len(set(times))


def test_the_shift_goes_with_the_pitch_on_the_way_back():
    steps = Stand(replace(FEW, forward=-0.02)).sweep()
    back = [step for step in steps[steps.index(next(s for s in steps if s.level == 8)) :] if step.level < 0]
    shares = [step.trunk.position[0] / -0.02 for step in back]
    assert shares[0] > 0.9
    assert shares == sorted(shares, reverse=True)
    assert [step.pitch > 0.0 for step in back] == [share > 0.0 for share in shares]
