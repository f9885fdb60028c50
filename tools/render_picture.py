"""Makes docs/picture.png from the samples: source, decoded, and where the decoded one is off, for one frame.

python tools/render_picture.py [OUT.png]
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
LEGEND = 110  # pixels, about: the picture with the colour bar is so much wider, to show the fox at the same size


def main() -> None:
    """Draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "target", metavar="OUT.png", nargs="?", default=str(ROOT / "docs" / "picture.png"), help="what to write"
    )
    draw(parser.parse_args().target)


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
