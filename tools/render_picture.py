"""Makes docs/picture.png and docs/moving.gif from a sample.

    python tools/render_picture.py [PICTURE.png [MOVING.gif]]

The picture shows source, decoded, and where the decoded one is off, for one frame; the other shows every third decoded frame.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

import gvpipe
from gvpipe.rasterizer.camera import framing

ROOT = Path(__file__).parents[1]
FRAME, SIZE, VIEW = 30, (400, 310), (62.0, 14.0)
MOVING, EVERY, COLOURS = (400, 250), 3, 20
LEGEND = 110  # pixels, about: the picture with the colour bar is so much wider, to show the fox at the same size


def main() -> None:
    """Draw both."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    docs = ROOT / "docs"
    parser.add_argument("picture", metavar="PICTURE.png", nargs="?", default=str(docs / "picture.png"), help="what to write")
    parser.add_argument("moving", metavar="MOVING.gif", nargs="?", default=str(docs / "moving.gif"), help="what to write")
    given = parser.parse_args()
    draw(given.picture)
    draw_moving(given.moving)


def draw_moving(target: str) -> None:
    """Encode the sample, draw its frames, and keep every third in few colours."""
    source = gvpipe.read(ROOT / "samples" / "creature.npz")
    with tempfile.TemporaryDirectory() as folder:
        video, film = Path(folder) / "creature.mp4", Path(folder) / "creature.gif"
        gvpipe.encode(source, video)
        gvpipe.render(video, film, size=MOVING, view=VIEW, follow=True)
        with Image.open(film) as drawn:
            frames = []
            for k in range(0, source.n_frames, EVERY):
                drawn.seek(k)
                frames.append(drawn.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE))
    milliseconds = round(1000 * EVERY / source.fps)
    frames[0].save(target, save_all=True, append_images=frames[1:], duration=milliseconds, loop=0, optimize=True)
    print(f"{target}: {len(frames)} frames, {Path(target).stat().st_size} bytes")


def draw(target: str) -> None:
    """Encode the sample, draw it three times and write the pictures side by side."""
    source = gvpipe.read(ROOT / "samples" / "creature.npz")
    camera = framing(source, [FRAME], VIEW, aspect=SIZE[0] / SIZE[1])
    with tempfile.TemporaryDirectory() as folder:
        video = Path(folder) / "creature.mp4"
        report = gvpipe.encode(source, video)
        parts = [Path(folder) / f"{name}.png" for name in ("source", "decoded", "error")]
        gvpipe.render(source, parts[0], frame=FRAME, size=SIZE, camera=camera)
        gvpipe.render(video, parts[1], frame=FRAME, size=SIZE, camera=camera)
        gvpipe.render(video, parts[2], frame=FRAME, size=(SIZE[0] + LEGEND, SIZE[1]), camera=camera, error_of=source)
        picture = Image.fromarray(np.concatenate([np.asarray(Image.open(part)) for part in parts], axis=1))
    picture.save(target, optimize=True)
    print(f"{target}: frame {FRAME}, {report.bytes} bytes of geometry video, {report.bpvf:.2f} bits per vertex and frame")


if __name__ == "__main__":
    main()
