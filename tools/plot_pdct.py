"""The plots in docs/experiments/pdct-rates.md: rate and error of ``pdct`` against cluster count and kept coefficients.

    python tools/plot_pdct.py chicken.npz [FRAMES]

The paper's figures 4 and 5 (Amjoun and Strasser 2008). Needs matplotlib.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import gvpipe
from gvcodecs.pdct import Pdct
from gvpipe.metrics.comparison import compare
from gvpipe.model.sequence import MeshSequence

CLUSTERS = (5, 10, 20, 40, 60, 80)
KEPT = (0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0)
QUALITY = 60.0


def main() -> None:
    """Draw both figures into docs/."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", metavar="FILE.npz", help="the sequence")
    parser.add_argument("frames", metavar="FRAMES", nargs="?", type=int, help="only so many of its frames")
    options = parser.parse_args()
    whole = gvpipe.read(options.file)
    sequence = whole.part(0, min(options.frames or whole.n_frames, whole.n_frames))
    folder = Path(__file__).parents[1] / "docs"
    rows = [measure(sequence, Pdct(quality=QUALITY, clusters=k)) for k in CLUSTERS]
    print("clusters", *zip(CLUSTERS, rows, strict=True), sep="\n")
    draw(folder / "pdct_clusters.png", "clusters", [("by cost", CLUSTERS, rows)])
    curves = []
    for k in (10, 20, 40):
        rows = [measure(sequence, Pdct(quality=QUALITY, clusters=k, kept=kept)) for kept in KEPT]
        print(f"kept, {k} clusters", *zip(KEPT, rows, strict=True), sep="\n")
        curves.append((f"{k} clusters", tuple(100 * kept for kept in KEPT), rows))
    draw(folder / "pdct_kept.png", "kept coefficients, %", curves)


def measure(sequence: MeshSequence, settings: Pdct) -> tuple[float, float]:
    """Bits per vertex and frame of all sections, and da."""
    bitstream = settings.encode(sequence).bitstream
    reader = Pdct.reader(bitstream)
    decoded = MeshSequence(reader.read(0, sequence.n_frames), reader.faces, sequence.fps)
    bits = 8 * sum(map(len, bitstream.sections.values()))
    return bits / sequence.n_frames / sequence.n_vertices, float(compare(sequence, decoded).da or np.nan)


def draw(path: Path, label: str, curves: list[tuple[str, tuple[float, ...], list[tuple[float, float]]]]) -> None:
    """Rate on the left, error on the right."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(7, 2.6), dpi=80)
    for side, (axis, name) in enumerate(zip(axes, ("bits per vertex and frame", "da"), strict=True)):
        for title, x, rows in curves:
            axis.plot(x, [row[side] for row in rows], "o-", ms=3, label=title)
        axis.set(xlabel=label, ylabel=name, ylim=(0, None))
        axis.grid(alpha=0.3)
        if len(curves) > 1:
            axis.set_xscale("log")
    if len(curves) > 1:
        axes[0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(path)


if __name__ == "__main__":
    main()
