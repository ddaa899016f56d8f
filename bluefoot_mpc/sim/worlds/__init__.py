"""Worlds to walk in: plans from a seed or a file, and what MuJoCo makes of them."""
