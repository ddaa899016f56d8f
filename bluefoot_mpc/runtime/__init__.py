"""Running a robot: the loop, recording, reading logs back, replay and the summary of a run."""
