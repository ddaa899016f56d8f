"""Trunk levelling: what the legs' motion does to the trunk is learnt and counteracted."""
