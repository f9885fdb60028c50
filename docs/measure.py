"""The numbers in docs/benchmarks.md: rate and error over a sweep of qualities, log-interpolated at given KG errors.

    python docs/measure.py SEQUENCE... [--set KEY=VALUE]... [--qualities 0,20,40,60,80,100] [--kg 1.0,0.3,0.1]

Prints Markdown. Every row is a whole file, decoded again and compared with its source.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

import gvpipe
from gvpipe.codec import codec_class

Row = dict[str, float]


def main() -> None:
    """Measure the sequences given on the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sequences", nargs="+", type=Path)
    parser.add_argument("--codec", default="mcgv")
    parser.add_argument("--set", dest="pairs", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--qualities", default="0,20,40,60,80,100")
    parser.add_argument("--kg", default="1.0,0.3,0.1")
    options = parser.parse_args()
    settings = dict(pair.split("=", 1) for pair in options.pairs)
    targets = [float(text) for text in options.kg.split(",")]
    print("| sequence | quality | bpvf | KG | rmse_diag | max_diag | video share | encode s | decode fps |")
    print("|---|---|---|---|---|---|---|---|---|")
    summary = []
    for path in options.sequences:
        rows = [measure(path, options.codec, {**settings, "quality": q}) for q in options.qualities.split(",")]
        for quality, row in zip(options.qualities.split(","), rows, strict=True):
            print(
                f"| {path.stem} | {quality} | {row['bpvf']:.3f} | {row['kg']:.3f} | {row['rmse_diag']:.2e} "
                f"| {row['max_diag']:.2e} | {row['video']:.0%} | {row['encode']:.1f} | {row['fps']:.0f} |",
                flush=True,
            )
        summary.append(f"| {path.stem} | " + " | ".join(at(rows, kg) for kg in targets) + " |")
    print("\n| sequence | " + " | ".join(f"bpvf at KG {kg:g}" for kg in targets) + " |")
    print("|---" * (len(targets) + 1) + "|")
    print("\n".join(summary))


def measure(path: Path, codec: str, texts: dict[str, str]) -> Row:
    """Encode, decode and compare once."""
    source = gvpipe.read(path)
    with tempfile.TemporaryDirectory() as folder:
        video = Path(folder) / "a.mp4"
        report = gvpipe.encode(source, video, codec_class(codec).from_texts(texts))
        started = time.perf_counter()
        decoded = gvpipe.decode(video)
        seconds = time.perf_counter() - started
        values = gvpipe.compare(source, decoded)
        share = gvpipe.info(video).sections["video"] / report.bytes
    return {
        "bpvf": report.bpvf,
        "kg": values.kg or 0.0,
        "rmse_diag": values.rmse_diag or 0.0,
        "max_diag": values.max_diag or 0.0,
        "video": share,
        "encode": report.seconds["encode"],
        "fps": source.n_frames / seconds,
    }


def at(rows: list[Row], kg: float) -> str:
    """Return the rate at an error, interpolated between the logarithms of both; nothing is extrapolated."""
    ordered = sorted(rows, key=lambda row: row["kg"])
    errors = np.array([row["kg"] for row in ordered])
    if errors[0] > kg:
        return f"not reached (best {errors[0]:.2f})"
    if errors[-1] < kg:
        return f"<= {ordered[-1]['bpvf']:.3f} (KG {errors[-1]:.2f})"
    rates = np.array([row["bpvf"] for row in ordered])
    return f"{np.exp(np.interp(np.log(kg), np.log(errors), np.log(rates))):.3f}"


if __name__ == "__main__":
    main()
