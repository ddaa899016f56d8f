"""The README's picture: the walking robot, rendered offline from a recorded run.

    python benchmarks/readme_picture.py [LOG] [--time S] [--out FILE] [--gif FILE]

Without a log it walks the robot for a few seconds first. Needs no screen: MuJoCo
draws through EGL (Debian: libegl1, libgl1-mesa-dri) or, with MUJOCO_GL=osmesa,
through libosmesa6.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")

import mujoco
import numpy as np
from PIL import Image

from bluefoot_mpc.model.robot import RobotModel, load_robot
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.runtime.log import read_log
from bluefoot_mpc.scenarios.options import RunOptions
from bluefoot_mpc.scenarios.runner import run
from bluefoot_mpc.sim.convert import q_to_mujoco
from bluefoot_mpc.types import LEGS, FloatArray
from bluefoot_mpc.viz.style import LEG_COLOURS

OUT = Path(__file__).parents[1] / "docs" / "images" / "walk.png"
SIZE = (1280, 720)
GIF_SIZE = (560, 316)
GIF_FPS = 25
LOOK_AT = np.array([0.0, 0.0, 0.062])


def main() -> None:
    """Render the still, and the film where one is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log", type=Path, nargs="?", help="a recorded simulator run; by default a fresh walk")
    parser.add_argument("--time", type=float, help="s since the start; by default the middle of a late swing")
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument("--gif", type=Path, help="also write a short film")
    arguments = parser.parse_args()
    data = read_log(arguments.log) if arguments.log else fresh_walk()
    time = np.array([sample.time for sample in data.truth])
    time -= time[0]
    q = np.array([sample.q for sample in data.truth])
    index = (
        highest_swing(data, time) if arguments.time is None else int(np.searchsorted(time, arguments.time))
    )
    model = stage(load_robot())
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    # Drawn at twice the size and scaled down: smoother edges than multisampling alone.
    picture = Image.fromarray(shoot(model, [q[index]], (2 * SIZE[0], 2 * SIZE[1]))[0])
    picture.resize(SIZE, Image.Resampling.LANCZOS).save(arguments.out, optimize=True)
    print(f"{arguments.out}: the robot at {time[index]:.2f} s")
    if arguments.gif:
        film(model, q, time, index, arguments.gif)


def fresh_walk() -> RunData:
    """A few seconds of trot at 60 mm/s."""
    with tempfile.TemporaryDirectory() as folder:
        return run("walk", RunOptions(duration=6.0, out=Path(folder), report=False)).data


def highest_swing(data: RunData, time: FloatArray) -> int:
    """The tick, after things have settled, at which the front left foot is highest."""
    height = np.array([sample.foot_height[0] for sample in data.truth])
    return int(np.argmax(np.where(time > 0.6 * time[-1], height, -1.0)))


def stage(robot: RobotModel) -> mujoco.MjModel:
    """The robot's visual shapes on a checkered floor under studio lights."""
    spec = mujoco.MjSpec.from_string(robot.urdf)
    spec.body("trunk").add_freejoint(name="root")
    for geom in spec.geoms:
        geom.group = 2 if geom.contype == 0 else 3
    for leg in LEGS:
        colour = [int(LEG_COLOURS[leg][k : k + 2], 16) / 255 for k in (1, 3, 5)]
        for geom in spec.body(f"{leg}_link4").geoms:
            if geom.type == mujoco.mjtGeom.mjGEOM_SPHERE and geom.group == 2:
                geom.material, geom.rgba = "", [*colour, 1.0]
    add_surroundings(spec)
    return spec.compile()


def add_surroundings(spec: mujoco.MjSpec) -> None:
    """Sky, floor, lights and picture quality."""
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.93, 0.95, 0.97],
        rgb2=[0.70, 0.77, 0.85],
        width=512,
        height=512,
    )
    spec.add_texture(
        name="checker",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=[0.66, 0.69, 0.73],
        rgb2=[0.52, 0.56, 0.62],
        width=512,
        height=512,
    )
    material = spec.add_material(
        name="floor", texrepeat=[5.0, 5.0], texuniform=True, reflectance=0.05, specular=0.1
    )
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "checker"
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[20.0, 20.0, 0.1],
        material="floor",
        contype=0,
        conaffinity=0,
        group=2,
    )
    spec.worldbody.add_light(
        pos=[1.2, -1.4, 2.4],
        dir=[-0.42, 0.5, -0.9],
        type=mujoco.mjtLightType.mjLIGHT_SPOT,
        cutoff=40.0,
        exponent=4.0,
        diffuse=[0.62, 0.60, 0.56],
        specular=[0.35, 0.35, 0.35],
        castshadow=True,
    )
    spec.worldbody.add_light(
        pos=[-1.5, 1.0, 2.0],
        dir=[0.6, -0.4, -0.8],
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        diffuse=[0.22, 0.25, 0.30],
        specular=[0.1, 0.1, 0.1],
        castshadow=False,
    )
    spec.visual.headlight.ambient = [0.36, 0.36, 0.38]
    spec.visual.headlight.diffuse = [0.22, 0.22, 0.22]
    spec.visual.headlight.specular = [0.1, 0.1, 0.1]
    spec.visual.quality.shadowsize = 8192
    spec.visual.quality.offsamples = 8
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 2 * SIZE[0], 2 * SIZE[1]
    spec.visual.global_.fovy = 28.0
    spec.visual.map.znear = 0.02
    spec.stat.extent = 1.0


def shoot(model: mujoco.MjModel, poses: list[FloatArray], size: tuple[int, int]) -> list[np.ndarray]:
    """Pictures (height, width, 3) of poses (23,) in house order; the camera goes along."""
    data = mujoco.MjData(model)
    camera, option = mujoco.MjvCamera(), mujoco.MjvOption()
    option.geomgroup[:] = 0
    option.geomgroup[2] = 1
    camera.azimuth, camera.elevation, camera.distance = 122.0, -19.0, 1.12
    pictures = []
    with mujoco.Renderer(model, size[1], size[0]) as renderer:
        for q in poses:
            data.qpos[:] = q_to_mujoco(q)
            # The stage, lights included, comes along with the robot.
            data.qpos[:2] = 0.0
            mujoco.mj_forward(model, data)
            camera.lookat[:] = LOOK_AT
            renderer.update_scene(data, camera, option)
            shift_floor(renderer.scene, q)
            pictures.append(renderer.render().copy())
    return pictures


def shift_floor(scene: mujoco.MjvScene, q: FloatArray) -> None:
    """Move the floor back under the robot by a whole number of tiles less than its way."""
    tile = 0.4
    for geom in scene.geoms[: scene.ngeom]:
        if geom.type == mujoco.mjtGeom.mjGEOM_PLANE:
            geom.pos[0], geom.pos[1] = -(q[0] % tile), -(q[1] % tile)


def film(model: mujoco.MjModel, q: FloatArray, time: FloatArray, index: int, path: Path) -> None:
    """A short film that ends where the still was taken."""
    wanted = time[index] - np.arange(2.3, 0.0, -1.0 / GIF_FPS)
    poses = [q[min(int(np.searchsorted(time, t)), len(q) - 1)] for t in wanted if t > 0.0]
    frames = [
        Image.fromarray(p).resize(GIF_SIZE, Image.Resampling.LANCZOS)
        for p in shoot(model, poses, (1120, 632))
    ]
    # One palette for all frames, so that still areas stay still and small.
    palette = frames[0].quantize(96)
    packed = [frame.quantize(96, palette=palette, dither=Image.Dither.NONE) for frame in frames]
    packed[0].save(
        path, save_all=True, append_images=packed[1:], duration=1000 // GIF_FPS, loop=0, optimize=True
    )
    print(f"{path}: {len(packed)} frames, {path.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
