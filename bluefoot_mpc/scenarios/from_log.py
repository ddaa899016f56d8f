"""The controller of a recorded run, built anew."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.exceptions import ConfigurationError, LogError
from bluefoot_mpc.model.parameters import RobotParameters
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.scenarios.folder import start_weights
from bluefoot_mpc.settings import build


def pipeline_from_log(data: RunData, folder: Path | None = None) -> Pipeline:
    """The controller that a log's configuration describes, as today's code builds it.

    Args:
        data: the run.
        folder: where its log lies, with the weights that its network began with; None where they
            are to be read from where the configuration says.

    Raises:
        LogError: the log does not hold a configuration that today's code understands, or the
            weights are gone.
    """
    try:
        parameters = build(RobotParameters, data.config["model"], "model")
        control = build(ControlConfig, data.config["control"], "control")
    except (KeyError, ConfigurationError) as error:
        raise LogError(f"the log's configuration does not fit this version: {error}") from error
    if folder is not None and control.leveling.loads_weights:
        leveling = dataclasses.replace(control.leveling, weights=start_weights(folder))
        control = dataclasses.replace(control, leveling=leveling)
    return Pipeline(RobotModel(parameters), control, data.period)
