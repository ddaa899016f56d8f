"""Preview of the centre of mass over the support regions ahead."""

from bluefoot_mpc.zmp.preview.config import LAWS, PreviewConfig, PreviewWeights
from bluefoot_mpc.zmp.preview.controller import PreviewController
from bluefoot_mpc.zmp.preview.inputs import PreviewInputs
from bluefoot_mpc.zmp.preview.plan import ComPlan

__all__ = ["LAWS", "ComPlan", "PreviewConfig", "PreviewController", "PreviewInputs", "PreviewWeights"]
