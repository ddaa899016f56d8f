"""A search begins with a look around, goes where the marker was lost, and never stays anywhere."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import wrap_angle
from bluefoot_mpc.navigation.search import Phase, Search, SearchConfig, SearchWish
from tests.navigation.test_target import state

CONFIG = SearchConfig()


class Robot:
    """Does what a search wants; without a motion it goes straight on."""

    def __init__(self, *, blocked: bool = False) -> None:
        self.time = self.x = self.y = self.yaw = 0.0
        self.blocked = blocked

    def go(self, search: Search, lost: np.ndarray | None, seconds: float) -> list[SearchWish]:
        wishes = []
        for _ in range(int(seconds / 0.02)):
            wish = search.step(state(self.time, self.x, self.y, self.yaw), lost)
            wishes.append(wish)
            self.time += 0.02
            if self.blocked:
                continue
            if wish.motion is not None:
                self.yaw = wrap_angle(self.yaw + 0.02 * wish.motion.yaw_rate)
            else:
                heading = self.yaw
                if wish.goal is not None:
                    heading = math.atan2(wish.goal[1] - self.y, wish.goal[0] - self.x)
                self.x += 0.02 * 0.15 * math.cos(heading)
                self.y += 0.02 * 0.15 * math.sin(heading)
        return wishes


def phases(wishes: list[SearchWish]) -> list[Phase]:
    """The phases in their order, each once while it lasts."""
    return [w.phase for k, w in enumerate(wishes) if k == 0 or w.phase is not wishes[k - 1].phase]


def test_never_seen_a_whole_turn_then_wandering_and_again() -> None:
    robot = Robot()
    wishes = robot.go(Search(CONFIG), None, 36.0)
    assert phases(wishes) == [Phase.LOOK, Phase.WANDER, Phase.LOOK]
    turn = [w for w in wishes if w.phase is Phase.LOOK]
    assert all(w.motion is not None and w.motion.x == 0.0 for w in turn)
    first = next(k for k, w in enumerate(wishes) if w.phase is Phase.WANDER)
    assert first * 0.02 * CONFIG.turn_rate == pytest.approx(2.0 * math.pi, abs=0.05)
    wander = next(w for w in wishes if w.phase is Phase.WANDER)
    assert wander.motion is None
    assert wander.goal is None


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_lost_to_a_side_turn_there_go_there_look_around(side: float) -> None:
    lost = np.array([0.3, 2.0 * side, 0.2])
    robot = Robot()
    wishes = robot.go(Search(CONFIG), lost, 60.0)
    assert phases(wishes)[:4] == [Phase.TURN, Phase.CHASE, Phase.LOOK, Phase.WANDER]
    assert wishes[0].motion is not None
    assert math.copysign(1.0, wishes[0].motion.yaw_rate) == side
    chase = next(w for w in wishes if w.phase is Phase.CHASE)
    assert chase.goal is not None
    assert chase.goal.tolist() == lost[:2].tolist()


def test_lost_straight_ahead_needs_no_turn() -> None:
    wishes = Robot().go(Search(CONFIG), np.array([3.0, 0.1, 0.2]), 0.1)
    assert wishes[0].phase is Phase.CHASE


def test_a_robot_that_cannot_move_is_not_asked_for_the_same_for_ever() -> None:
    wishes = Robot(blocked=True).go(Search(CONFIG), np.array([-2.0, 0.0, 0.2]), 150.0)
    assert set(phases(wishes)) == set(Phase)


def test_a_target_that_is_forgotten_on_the_way_does_no_harm() -> None:
    robot, search = Robot(), Search(CONFIG)
    robot.go(search, np.array([3.0, 0.0, 0.2]), 2.0)
    assert phases(robot.go(search, None, 5.0))[0] in (Phase.LOOK, Phase.CHASE)
    assert phases(robot.go(search, None, 1.0)) == [Phase.LOOK]


def test_reset_begins_afresh() -> None:
    robot, search = Robot(), Search(CONFIG)
    robot.go(search, None, 20.0)
    search.reset()
    assert robot.go(search, None, 0.1)[0].phase is Phase.LOOK


@pytest.mark.parametrize("wrong", [{"turn_rate": 0.0}, {"look_turn_deg": 5.0}, {"arrived": -1.0}])
def test_impossible_settings_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigurationError, match=next(iter(wrong))):
        SearchConfig(**wrong)
