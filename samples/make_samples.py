"""Make gvpipe's sample animations; runs with the same libraries write the same bytes.

`cloth`, `creature`, `morphs`, `robot` and `soft_body.npz` hold `vertices` (F, V, 3) float32 in metres, y up, `faces`
(T, 3) int32, counter-clockwise from outside, and `fps`. `ball_frames/` holds one OBJ file for each frame. `flag.npz` has
two parts, quads, uv with a texture, normals with hard edges, and a field. `banner.mp4` has a picture for each of its frames.
`voice.wav` is a tune with a click at each second.

    python make_samples.py [OUTPUT_FOLDER]
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import numpy.typing as npt
from animation import Animation
from banner import write_banner
from bounce import make_bounce
from cloth import make_cloth
from creature import make_creature
from flag import make_flag
from morphs import make_morphs
from robot import make_robot
from soft_body import make_soft_body
from voice import write_voice

import gvpipe

SEQUENCES = {
    "cloth": make_cloth,
    "creature": make_creature,
    "morphs": make_morphs,
    "robot": make_robot,
    "soft_body": make_soft_body,
}
GRID = 2.0**-13  # m; a power of two leaves the low bits of each float32 zero, which then compress


def main() -> None:
    """Write all samples to the folder given, by default the one that this script is in."""
    parser = argparse.ArgumentParser(description="Make gvpipe's sample animations.")
    here = Path(__file__).resolve().parent
    parser.add_argument("output", nargs="?", type=Path, default=here, metavar="OUTPUT_FOLDER")
    folder: Path = parser.parse_args().output
    folder.mkdir(parents=True, exist_ok=True)
    for name, make in SEQUENCES.items():
        animation = make()
        write_npz(folder / f"{name}.npz", animation)
        report(f"{name}.npz", animation, (folder / f"{name}.npz").stat().st_size)
    flag = make_flag()
    gvpipe.write(flag, folder / "flag.npz")
    print(f"flag.npz: {flag.n_frames} frames, {flag.n_vertices} vertices, {len(flag.faces)} triangles")
    write_banner(folder / "banner.mp4")
    print(f"banner.mp4: {(folder / 'banner.mp4').stat().st_size / 1e3:.1f} kB")
    bounce = make_bounce()
    write_obj_frames(folder / "ball_frames", bounce)
    n_bytes = sum(file.stat().st_size for file in (folder / "ball_frames").glob("ball_*.obj"))
    report("ball_frames", bounce, n_bytes)
    write_voice(folder / "voice.wav")
    print(f"voice.wav: {(folder / 'voice.wav').stat().st_size / 1e3:.1f} kB")


def write_npz(path: Path, animation: Animation) -> None:
    """Write the arrays, vertices rounded to GRID.

    Fortran order stores the path of each coordinate together. Deflate then needs a quarter less than frame after frame,
    and numpy reads back the same (F, V, 3) array.
    """
    vertices = np.asfortranarray(round_to_grid(animation.vertices))
    np.savez_compressed(path, vertices=vertices, faces=animation.faces, fps=np.float64(animation.fps))


def write_obj_frames(folder: Path, animation: Animation) -> None:
    """Write ball_0001.obj and so on, in metres, rounded to 0.1 mm."""
    folder.mkdir(parents=True, exist_ok=True)
    faces = "".join(f"f {a} {b} {c}\n" for a, b, c in (animation.faces + 1).tolist())
    for number, frame in enumerate(animation.vertices, start=1):
        # Adding 0 turns -0.0 into 0.0.
        vertices = "".join(f"v {x:.4f} {y:.4f} {z:.4f}\n" for x, y, z in (np.round(frame, 4) + 0.0).tolist())
        (folder / f"ball_{number:04d}.obj").write_bytes((vertices + faces).encode("ascii"))


def round_to_grid(vertices: npt.NDArray[np.float64]) -> npt.NDArray[np.float32]:
    """Return vertices (F, V, 3), m, as float32 multiples of GRID, without -0."""
    rounded: npt.NDArray[np.float32] = (np.round(vertices / GRID) * GRID + 0.0).astype(np.float32)
    return rounded


def report(name: str, animation: Animation, n_bytes: int) -> None:
    """Print one line about a sample."""
    n_frames, n_vertices, _ = animation.vertices.shape
    counts = f"{n_frames} frames, {n_vertices} vertices, {len(animation.faces)} triangles"
    print(f"{name}: {counts}, {n_bytes / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
