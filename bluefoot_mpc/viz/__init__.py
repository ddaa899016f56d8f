"""Pictures of a robot and its runs: report, 3D replay, live view, figures."""
