"""Which law moves the trunk, and how one takes over from the other; the laws are made of paper here."""

from types import SimpleNamespace

import numpy as np
import pytest

from bluefoot_mpc.control.gait_sway import GaitSway, SwayConfig

DT = 0.02
JOINTS = np.zeros(16)


class Law:
    """A law that goes to its place by a tenth of the way each tick, and remembers what it was told."""

    def __init__(self, place, zmp):
        self.place, self.zmp = np.array(place), np.array(zmp)
        self.steps = self.resets = self.forgets = 0
        self.plan, self.poses, self.seen = None, [], []
        self.offset = np.zeros(2)

    def reset(self):
        self.resets += 1
        self.offset = np.zeros(2)
        self.plan = None

    def forget(self):
        self.forgets += 1
        self.offset = np.zeros(2)
        self.plan = None

    def follow(self, pose):
        self.poses.append(pose)

    def step(self, gait, joints, trunk, dt):
        self.steps += 1
        self.seen.append(trunk)
        self.plan = object()
        self.offset = self.offset + 0.1 * (self.place - self.offset)
        return self.zmp


def make(trot="static", walk="preview"):
    static, preview = Law((0.01, 0.0), (1.0, 0.0)), Law((0.0, -0.03), (0.0, 1.0))
    return GaitSway(SwayConfig(trot=trot, walk=walk), static, preview), static, preview


def run(sway, place, steps=1):
    """Steps at a place between the gaits, with the trunk where it was wanted; offsets and ZMPs."""
    out = []
    for _ in range(steps):
        trunk = np.array([0.002, 0.003, 0.11])
        trunk[:2] += sway.offset
        zmp = sway.step(SimpleNamespace(place=place), JOINTS, trunk, DT)
        out.append((sway.offset.copy(), zmp))
    return out


@pytest.mark.parametrize(("trot", "walk", "place", "runs"), [
    ("static", "preview", 0.0, (1, 0)), ("static", "preview", 1.0, (0, 1)),
    ("static", "preview", 0.4, (1, 1)), ("preview", "static", 0.0, (0, 1)),
    ("preview", "static", 1.0, (1, 0)), ("preview", "preview", 0.3, (0, 1)),
    ("static", "static", 0.7, (1, 0)),
])  # fmt: skip
def test_only_laws_that_have_a_say_are_run(trot, walk, place, runs):
    sway, static, preview = make(trot, walk)
    run(sway, place)
    assert (static.steps, preview.steps) == runs


def test_the_way_from_gait_to_gait_is_continuous():
    sway, _, _ = make()
    places = np.concatenate(
        [np.zeros(60), np.linspace(0.0, 1.0, 100), np.ones(60), np.linspace(1.0, 0.0, 100)]
    )
    offsets = np.array([run(sway, place)[0][0] for place in places])
    np.testing.assert_allclose(offsets[59], [0.01, 0.0], atol=1e-4)
    np.testing.assert_allclose(offsets[219], [0.0, -0.03], atol=1e-4)
    np.testing.assert_allclose(offsets[-1], [0.01, 0.0], atol=1e-3)
    jumps = np.abs(np.diff(offsets, axis=0)).max(axis=1)
    assert jumps[59:].max() < 1e-3  # on its own, a law moves by a tenth of its way


def test_offset_and_zmp_are_mixed_by_the_share():
    sway, static, preview = make()
    offset, zmp = run(sway, 0.25, 3)[-1]
    np.testing.assert_allclose(offset, 0.25 * preview.offset + 0.75 * static.offset)
    np.testing.assert_allclose(zmp, [0.75, 0.25])


def test_each_law_sees_the_trunk_where_it_alone_would_have_put_it():
    sway, static, preview = make()
    run(sway, 0.5, 5)
    np.testing.assert_allclose(static.seen[0], [0.002, 0.003, 0.11])
    before = 0.01 * (1.0 - 0.9**4)
    np.testing.assert_allclose(static.seen[-1], [0.002 + before, 0.003, 0.11])
    np.testing.assert_allclose(preview.seen[-1], [0.002, 0.003 - 3.0 * before, 0.11])


def test_a_preview_without_a_say_forgets_once():
    sway, _, preview = make()
    run(sway, 1.0, 3)
    assert sway.plan is preview.plan is not None
    run(sway, 0.0, 4)
    assert preview.forgets == 1
    assert sway.plan is None


def test_no_preview_is_made_where_no_gait_wants_one():
    static = Law((0.01, 0.0), (1.0, 0.0))
    sway = GaitSway(SwayConfig(), static, None)
    run(sway, 0.5, 2)
    sway.follow(np.ones(6))
    assert sway.plan is None
    assert static.steps == 2
    assert len(static.poses) == 1


def test_reset_and_commanded_poses_reach_both_laws():
    sway, static, preview = make()
    run(sway, 0.5, 3)
    resets = static.resets, preview.resets
    sway.reset()
    assert (static.resets, preview.resets) == (resets[0] + 1, resets[1] + 1)
    np.testing.assert_array_equal(sway.offset, 0.0)
    sway.follow(np.ones(6))
    assert len(static.poses) == len(preview.poses) == 1
