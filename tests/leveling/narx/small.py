"""A small network for the tests, signals for it, and a run over them."""

import numpy as np

from bluefoot_mpc.leveling.narx import Narx, NarxConfig

NU, NY = 3, 2
INPUT_SCALE, OUTPUT_SCALE = np.array([0.02, 1.0, 10.0]), np.array([5.0, 0.1])
SMALL = {"hidden": (6, 5), "gradient_bound": 0.0}


def make(**values):
    return Narx(NarxConfig(**{**SMALL, **values}), INPUT_SCALE, OUTPUT_SCALE)


def signals(ticks, seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(ticks, NU)) * INPUT_SCALE, rng.normal(size=(ticks, NY)) * OUTPUT_SCALE


def run(network, ticks=50, seed=0, learn=True):
    u, psi = signals(ticks, seed)
    values = []
    for k in range(ticks):
        network.train(psi[k], learn=learn)
        values.append(network.predict(u[k]).value)
    return np.array(values)


def flat(network):
    return np.concatenate([layer.ravel() for layer in network.weights.layers])
