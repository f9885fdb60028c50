"""From a body model's vertices to a geometry video: what a set of motion captures (AMASS, say) needs.

    python samples/body_model.py [OUT.mp4]

gvpipe reads no SMPL parameters: the body models are under licences of their own. Their packages pose the model, frame by frame
or some frames at a time, and gvpipe takes the vertices. `pose` stands for that call here; with smplx it would be

    model = smplx.create(folder, "smplx", num_betas=16, batch_size=len(poses))
    posed = model(betas=betas, body_pose=poses[:, 3:66], global_orient=poses[:, :3], transl=trans)
    vertices = posed.vertices.detach().numpy()                  # (n, V, 3)

with poses, trans and betas from the capture's ``.npz``, and `faces` from ``model.faces``. AMASS is Z up, in metres, and
``mocap_framerate`` is its rate.
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray

import gvpipe
from gvpipe.asset.metadata import Metadata

BATCH = 64  # frames that are posed at a time
FPS = 60.0  # of the capture
N_FRAMES = 120
AROUND, RINGS = 24, 40


class PosedFrames:
    """Vertices ``(F, V, 3) float32``, posed when they are read: an encoder passes over a long capture without holding it."""

    def __init__(self, poses: NDArray[np.float64], template: NDArray[np.float64]) -> None:
        self._poses, self._template = poses, template
        self.shape = (len(poses), *template.shape)

    def __getitem__(self, frames: slice) -> NDArray[np.float32]:
        wanted = self._poses[frames]
        blocks = [pose(wanted[at : at + BATCH], self._template) for at in range(0, len(wanted), BATCH)]
        return np.concatenate(blocks) if blocks else np.zeros((0, *self.shape[1:]), np.float32)


def pose(poses: NDArray[np.float64], template: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return vertices ``(n, V, 3)`` for poses ``(n, 2)``: here a limb that bends and turns, in place of a body model."""
    bend = poses[:, :1] * template[:, 2] ** 2  # (n, V)
    x, y, z = template.T
    posed = np.stack([x * np.cos(bend) + z * np.sin(bend), np.broadcast_to(y, bend.shape), z * np.cos(bend)], axis=2)
    turn = poses[:, 1]
    cos, sin, zero, one = np.cos(turn), np.sin(turn), np.zeros_like(turn), np.ones_like(turn)
    turns = np.stack([cos, -sin, zero, sin, cos, zero, zero, zero, one], axis=1).reshape(-1, 3, 3)
    return np.asarray(posed @ turns.transpose(0, 2, 1), np.float32)


def limb() -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Vertices ``(V, 3)`` and triangles ``(T, 3)`` of a tube along z."""
    ring, corner = np.divmod(np.arange(AROUND * RINGS), AROUND)
    angle = 2 * np.pi * corner / AROUND
    vertices = np.stack([0.1 * np.cos(angle), 0.1 * np.sin(angle), ring / (RINGS - 1)], axis=1)
    a = np.flatnonzero(ring < RINGS - 1)
    b = np.where(corner[a] == AROUND - 1, a - AROUND + 1, a + 1)
    faces = np.concatenate([np.stack([a, b, b + AROUND], 1), np.stack([a, b + AROUND, a + AROUND], 1)])
    return vertices, faces.astype(np.int32)


def main() -> None:
    """Encode a capture, and print what it takes."""
    target = sys.argv[1] if len(sys.argv) > 1 else "body.mp4"
    template, faces = limb()
    time = np.arange(N_FRAMES) / FPS
    poses = np.stack([0.8 * np.sin(2 * np.pi * time), 0.5 * time], axis=1)
    body = gvpipe.MeshSequence(PosedFrames(poses, template), faces, FPS, metadata=Metadata("z", 1.0, source="capture.npz"))
    report = gvpipe.encode(body, target, "pca")
    print(f"{target}: {report.frames} frames of {report.vertices} vertices, {report.bytes} bytes")


if __name__ == "__main__":
    main()
