"""Schedules and inputs that tests of the preview share."""

import numpy as np

from bluefoot_mpc.types import ContactSchedule
from bluefoot_mpc.zmp.preview import PreviewInputs

FEET = np.array([[0.165, 0.165], [0.165, -0.165], [-0.165, 0.165], [-0.165, -0.165]])
ORDER = (0, 3, 1, 2)
"""Legs of the walk in the order in which they swing."""


def walk(config, phase=0.0, *, speed=0.03, cycle=1.25, swing=0.2):
    """A walk: one leg in the air for `swing` of the cycle, four feet between; feet step on as they land."""
    time = config.interval * np.arange(1, config.samples + 1)
    clock = phase + time / cycle
    stance = np.ones((len(time), 4), dtype=bool)
    places = np.zeros((len(time), 4, 3))
    for place, leg in enumerate(ORDER):
        own = clock - 0.25 * place
        stance[:, leg] = own % 1.0 >= swing
        steps = np.floor(own) - np.floor(phase - 0.25 * place)
        places[:, leg, :2] = FEET[leg]
        places[:, leg, 0] += speed * cycle * (steps - (phase - 0.25 * place) % 1.0 + 0.5)
    return ContactSchedule(time=time, stance=stance, footholds=places)


def trot(config, phase=0.0, *, cycle=0.36):
    """A trot on the spot: diagonal pairs, a moment of four feet between."""
    time = config.interval * np.arange(1, config.samples + 1)
    own = (phase + time / cycle)[:, None] - np.array([0.0, 0.5, 0.5, 0.0])
    places = np.zeros((len(time), 4, 3))
    places[:, :, :2] = FEET
    return ContactSchedule(time=time, stance=own % 1.0 >= 0.4, footholds=places)


def inputs(schedule, *, speed=0.03, **others):
    """Inputs with the nominal place under the moving b'."""
    nominal = np.stack([speed * schedule.time, np.zeros(len(schedule.time))], axis=1)
    return PreviewInputs(schedule=schedule, nominal=nominal, **others)


def state(rng, scale=1.0):
    """(3, 2) a start near the middle of the feet."""
    return scale * rng.normal(size=(3, 2)) * [[0.01], [0.05], [0.3]]


class BrokenSolver:
    """A backend that ends as it is told, never solved."""

    def __init__(self, answer):
        self.answer, self.calls = answer, 0

    def solve(self, problem):
        self.calls += 1
        return self.answer(problem)

    def reset(self):
        self.calls = 0
