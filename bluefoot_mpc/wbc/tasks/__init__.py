"""What the plan should do: each task an error, its Jacobian as rows of the unknowns, gains and a weight."""

from bluefoot_mpc.wbc.tasks.com import com_task
from bluefoot_mpc.wbc.tasks.feet import foot_task
from bluefoot_mpc.wbc.tasks.momentum import momentum_task
from bluefoot_mpc.wbc.tasks.posture import posture_target
from bluefoot_mpc.wbc.tasks.trunk import trunk_task

__all__ = ["com_task", "foot_task", "momentum_task", "posture_target", "trunk_task"]
