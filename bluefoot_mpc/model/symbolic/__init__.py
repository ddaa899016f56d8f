"""Rigid-body dynamics as CasADi expressions, written over any Pinocchio model with a free flyer."""

from bluefoot_mpc.model.symbolic.joints import Joint, tree_joints
from bluefoot_mpc.model.symbolic.terms import dynamics_function
from bluefoot_mpc.model.symbolic.tree import FootTerms, SymbolicTree, TreeState

__all__ = ["FootTerms", "Joint", "SymbolicTree", "TreeState", "dynamics_function", "tree_joints"]
