"""What pictures of a world need and physics does not: light from above, tiles on the floor, a background."""

from __future__ import annotations

import mujoco

_TILE = 0.25
"""m, side of a tile of the floor."""
_FLOOR, _JOINT = (0.80, 0.78, 0.73), (0.70, 0.68, 0.63)
_ABOVE, _HORIZON = (0.86, 0.88, 0.90), (0.62, 0.64, 0.66)
_AMBIENT, _FROM_CAMERA = 0.36, 0.20
_SIDE = 64
"""Pixels of a texture's side; of the background's it is enough for a gradient."""


def add_scenery(spec: mujoco.MjSpec, tiled: bool) -> None:
    """Add light and background, and tiles to the floor.

    Args:
        spec: robot and world, before it is compiled.
        tiled: whether the world's planes get tiles; those of a user's file stay as they are.
    """
    light = spec.visual.headlight
    light.active = 1
    light.ambient, light.diffuse, light.specular = [_AMBIENT] * 3, [_FROM_CAMERA] * 3, [0.0] * 3
    kinds, builtin = mujoco.mjtTexture, mujoco.mjtBuiltin
    if not any(texture.type == kinds.mjTEXTURE_SKYBOX for texture in spec.textures):
        spec.add_texture(
            name="scenery_background", type=kinds.mjTEXTURE_SKYBOX, builtin=builtin.mjBUILTIN_GRADIENT,
            rgb1=_ABOVE, rgb2=_HORIZON, width=_SIDE, height=6 * _SIDE,
        )  # fmt: skip
    if tiled:
        _add_tiles(spec)


def _add_tiles(spec: mujoco.MjSpec) -> None:
    kinds, builtin = mujoco.mjtTexture, mujoco.mjtBuiltin
    spec.add_texture(
        name="scenery_tile", type=kinds.mjTEXTURE_2D, builtin=builtin.mjBUILTIN_FLAT,
        mark=mujoco.mjtMark.mjMARK_EDGE, rgb1=_FLOOR, markrgb=_JOINT, width=_SIDE, height=_SIDE,
    )  # fmt: skip
    material = spec.add_material(
        name="scenery_floor", texrepeat=[1.0 / _TILE] * 2, texuniform=True, specular=0.0, shininess=0.0
    )
    textures = list(material.textures)
    textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "scenery_tile"
    material.textures = textures
    for geom in spec.worldbody.geoms:
        if geom.type == mujoco.mjtGeom.mjGEOM_PLANE and not geom.material:
            geom.material = material.name
            geom.rgba = [1.0, 1.0, 1.0, 1.0]
