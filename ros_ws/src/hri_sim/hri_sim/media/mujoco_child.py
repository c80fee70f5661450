"""Child process of the video: draws a job with MuJoCo and writes raw pictures to stdout.

Run as ``python -m hri_sim.media.mujoco_child JOB.npz``; it is a process of its own because a broken
OpenGL driver may kill it.
"""

from __future__ import annotations

import math
import sys

import mujoco
import numpy as np

from hri_planner.robot.model import load_robot
from hri_sim.media.look import camera_for
from hri_sim.scenario.schema import Scenario
from hri_sim.simulator.scene import SceneConfig, build_scene

OPACITY = {"solid": 1.0, "glass": 0.35}


def main(job: str) -> None:
    """Draw all pictures of a job file."""
    with np.load(job, allow_pickle=False) as arrays:
        scenario = Scenario.model_validate_json(arrays["scenario"].tobytes())
        postures, arms = arrays["q"], arrays["arms"]
        width, height = (int(v) for v in arrays["size"])
        drawn = [(arrays[f"{k}_count"], arrays[f"{k}_shapes"], a) for k, a in OPACITY.items()]
    scene = build_scene(load_robot(), scenario, SceneConfig(width=width, height=height))
    data = mujoco.MjData(scene.model)
    view = camera_for(scenario)
    way = np.array(view.target) - np.array(view.eye)
    camera = mujoco.MjvCamera()
    camera.lookat[:] = view.target
    camera.distance = float(np.linalg.norm(way))
    camera.azimuth = math.degrees(math.atan2(way[1], way[0]))
    camera.elevation = math.degrees(math.asin(way[2] / camera.distance))
    scene.model.vis.global_.fovy = math.degrees(view.fov)
    with mujoco.Renderer(scene.model, height, width) as renderer:
        starts = [np.concatenate(([0], np.cumsum(count))) for count, _, _ in drawn]
        for number, (q, people) in enumerate(zip(postures, arms, strict=True)):
            data.qpos[:] = q
            for row, arm in enumerate(people):
                scene.place_arm(data, row, arm if np.isfinite(arm).all() else None)
            mujoco.mj_kinematics(scene.model, data)
            mujoco.mj_camlight(scene.model, data)
            renderer.update_scene(data, camera)
            for (_, shapes, opacity), start in zip(drawn, starts, strict=True):
                for shape in shapes[start[number] : start[number + 1]]:
                    _add_capsule(renderer.scene, shape, opacity)
            sys.stdout.buffer.write(renderer.render().tobytes())
    sys.stdout.buffer.flush()


def _add_capsule(scene: mujoco.MjvScene, shape: np.ndarray, opacity: float) -> None:
    """Add one decoration: ends (6), radius, colour (3); dropped when the scene is full."""
    if scene.ngeom >= scene.maxgeom:
        return
    geom = scene.geoms[scene.ngeom]
    colour = np.array((*shape[7:], opacity), np.float32)
    kind = mujoco.mjtGeom.mjGEOM_CAPSULE
    mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), colour)
    if np.array_equal(shape[:3], shape[3:6]):
        size = np.full(3, shape[6])
        sphere = mujoco.mjtGeom.mjGEOM_SPHERE
        mujoco.mjv_initGeom(geom, sphere, size, shape[:3], np.eye(3).ravel(), colour)
    else:
        mujoco.mjv_connector(geom, kind, shape[6], shape[:3], shape[3:6])
    scene.ngeom += 1


if __name__ == "__main__":
    main(sys.argv[1])
