"""What Blender reads of a scene, as NumPy arrays: python blender_positions.py FILE OUT.npz N_FRAMES FPS (a Python with bpy).

OUT holds ``positions (N_FRAMES, V, 3)`` of all meshes in world space, ordered by name, Z up as in Blender, and the names of its
meshes, materials and pictures, and of uv layers. Frame 0 is at second 0 in glTF files, at the first sample in others.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any

import numpy as np

bpy: Any = import_module("bpy")  # it has no types


def main(file: str, target: str, n_frames: int, fps: float) -> None:
    """Import the file and go through its frames."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.fps, scene.render.fps_base = round(fps), round(fps) / fps
    first = 0
    if file.endswith(".glb"):
        bpy.ops.import_scene.gltf(filepath=file)
    elif file.endswith(".abc"):
        bpy.ops.wm.alembic_import(filepath=file)
        first = scene.frame_start
    else:
        bpy.ops.wm.usd_import(filepath=file)
        first = scene.frame_start
    shapes = bpy.data.collections.get("glTF_not_exported")  # what Blender draws bones with
    drawn = [each for each in scene.objects if each.type == "MESH" and not (shapes and each.name in shapes.objects)]
    meshes = sorted(drawn, key=lambda each: str(each.name))
    frames = []
    for frame in range(n_frames):
        scene.frame_set(first + frame)
        graph = bpy.context.evaluated_depsgraph_get()
        frames.append(np.concatenate([points(each.evaluated_get(graph)) for each in meshes]))
    np.savez(
        target,
        positions=np.stack(frames),
        meshes=[each.name for each in meshes],
        materials=sorted({slot.material.name for each in meshes for slot in each.material_slots if slot.material}),
        pictures=sorted(each.name for each in bpy.data.images if each.size[0]),
        uv=sorted({layer.name for each in meshes for layer in each.data.uv_layers}),
    )


def points(placed: Any) -> Any:
    """The vertices ``(n, 3)`` of an evaluated object in world space."""
    found = np.empty(3 * len(placed.data.vertices), np.float32)
    placed.data.vertices.foreach_get("co", found)
    world = np.array(placed.matrix_world)
    return found.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))
