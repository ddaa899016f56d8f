"""Rough ground: point clouds, height maps, surfaces, costs, ways and footholds over them.

Pure functions of arrays; what moves the robot is in `navigation.crossing` and `control`.
"""
