"""What Blender draws of an animated glTF file, in the Python that has bpy.

python blender_picture.py FILE FRAME FPS EYE TARGET FOV SIDE OUT.png
"""

from __future__ import annotations

import json
import math
import sys

import bpy  # type: ignore[import-not-found]
from mathutils import Vector  # type: ignore[import-not-found]


def main() -> None:
    """Import, go to a frame, and draw it by Cycles without a ground; EYE and TARGET are JSON lists, Y up."""
    path, frame, fps, eye, target, fov, side, out = sys.argv[1:]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps = int(fps)
    bpy.ops.import_scene.gltf(filepath=path)
    place, aim = (Vector((x, -z, y)) for x, y, z in (json.loads(eye), json.loads(target)))
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = place
    camera.rotation_euler = (aim - place).to_track_quat("-Z", "Y").to_euler()
    camera.data.angle = math.radians(float(fov))
    camera.data.clip_start = 0.01
    scene.collection.objects.link(camera)
    scene.camera = camera
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 2.5, camera.rotation_euler
    scene.collection.objects.link(sun)
    scene.render.film_transparent = True
    scene.frame_set(int(frame))
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 32, False
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x = scene.render.resolution_y = int(side)
    scene.render.filepath = out
    bpy.ops.render.render(write_still=True)


if __name__ == "__main__":
    main()
