"""Model-based control of the BlueFoot quadruped."""
