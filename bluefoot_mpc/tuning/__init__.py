"""Finding gait parameters by simulation: what may vary, what is good, and a study that searches."""
