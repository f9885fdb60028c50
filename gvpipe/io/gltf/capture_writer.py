"""A capture as one animated GLB: a scene for each shot, shown in its frames.

glTF's own meshes keep their triangles. So each shot has a node of its own, above its meshes, whose scale is 1 in the shot's
frames and 0 in all others, by keys that are held (STEP). Every player knows scales; KHR_node_visibility, with an animation by
KHR_animation_pointer, is known to few. Inside of a shot, morph targets move the meshes, as in the file of a sequence.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gvpipe.foundation.arrays import Float64
from gvpipe.io.gltf.draco_writing import draco_notes
from gvpipe.io.gltf.glb import Glb, glb_at
from gvpipe.io.gltf.json_fields import Json
from gvpipe.io.gltf.scene_writing import prepare
from gvpipe.io.gltf.writer import animation_notes, most_targets, weight_channels, write_animation, write_moving
from gvpipe.model.capture import Capture

NOTE = "glTF's meshes keep their triangles: each of {} shots is a node of its own, whose scale is 0 outside of its frames"


def write_capture(capture: Capture, path: Path, compress: str = "none") -> tuple[str, ...]:
    """Write a capture as one animated GLB; return what it cannot hold, a line each.

    Args:
        capture: to be written.
        path: of the ``.glb``.
        compress: ``"meshopt"``, ``"draco"`` or ``"none"``.

    Raises:
        InputError: a shot has no triangles, or the file would be longer than a GLB can be.
        OutputError: the file cannot be written.
    """
    said = [NOTE.format(len(capture.shots))]
    times = np.arange(len(capture)) / capture.fps
    channels: list[tuple[Json, Json]] = []
    nodes: list[int] = []
    with glb_at(path, compress) as glb:
        for number, (begin, length, shot) in enumerate(zip(capture.starts, capture.lengths, capture.shots, strict=True)):
            prepared = prepare(shot, is_packed=compress == "meshopt")
            moving = write_moving(glb, prepared)
            (scene,) = glb.tree.pop("scenes")
            size = [1, 1, 1] if not number else [0, 0, 0]  # viewers that play nothing show the first shot
            nodes.append(glb.append("nodes", {"name": f"shot{number}", "children": scene["nodes"], "scale": size}))
            channels += weight_channels(glb, moving, times[begin : begin + length])
            channels.append(_shown(glb, nodes[-1], times, (begin, begin + length)))
            said += [*prepared.notes, *animation_notes(most_targets(moving))]
        glb.append("scenes", {"nodes": nodes})
        said += draco_notes(glb) if glb.is_draco else ()
        write_animation(glb, capture.shots[0], channels)
    return tuple(dict.fromkeys(said))


def _shown(glb: Glb, node: int, times: Float64, span: tuple[int, int]) -> tuple[Json, Json]:
    """A sampler and a target for the scale of a shot's node: 1 from the first frame of ``span`` up to the last, else 0."""
    keys = np.unique([0, span[0], min(span[1], len(times) - 1), len(times) - 1])
    is_shown = (keys >= span[0]) & (keys < span[1])
    sizes = np.repeat(is_shown[:, None], 3, axis=1).astype(np.float32)
    time = glb.array(times[keys].astype(np.float32)[:, None], bounds=True)
    sampler: Json = {"input": time, "output": glb.array(sizes), "interpolation": "STEP"}
    return sampler, {"node": node, "path": "scale"}
