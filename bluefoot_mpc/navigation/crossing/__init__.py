"""Crossing rough ground: sweep it with the LIDAR, map it, plan a way, follow it, sweep again."""
