"""Network with tapped delay lines that learns on line to predict the next output."""

from bluefoot_mpc.leveling.narx.config import NarxConfig
from bluefoot_mpc.leveling.narx.network import Narx, NarxStatus, Prediction
from bluefoot_mpc.leveling.narx.weights import NarxWeights, load_weights, save_weights

__all__ = ["Narx", "NarxConfig", "NarxStatus", "NarxWeights", "Prediction", "load_weights", "save_weights"]
