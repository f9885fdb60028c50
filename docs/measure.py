"""The numbers in docs/benchmarks.md: rate and error over a sweep of qualities, log-interpolated at given errors.

    python docs/measure.py SEQUENCE... [--set KEY=VALUE]... [--qualities 0,20,40,60,80,100] [--kg 1.0,0.3,0.1] [--sted 0.02]

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
    parser.add_argument("--sted", default="")
    options = parser.parse_args()
    settings = dict(pair.split("=", 1) for pair in options.pairs)
    targets = [
        (name, float(text)) for name in ("kg", "sted") for text in getattr(options, name).split(",") if text
    ]  # which error, and at which value
    print("| sequence | quality | bpvf | KG | STED | rmse_diag | max_diag | video share | encode s | decode fps |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    summary = []
    for path in options.sequences:
        rows = [measure(path, options.codec, {**settings, "quality": q}) for q in options.qualities.split(",")]
        for quality, row in zip(options.qualities.split(","), rows, strict=True):
            print(
                f"| {path.stem} | {quality} | {row['bpvf']:.3f} | {row['kg']:.3f} | {row['sted']:.4f} | {row['rmse_diag']:.2e} "
                f"| {row['max_diag']:.2e} | {row['video']:.0%} | {row['encode']:.1f} | {row['fps']:.0f} |",
                flush=True,
            )
        summary.append(f"| {path.stem} | " + " | ".join(at(rows, *target) for target in targets) + " |")
    print("\n| sequence | " + " | ".join(f"bpvf at {name.upper()} {value:g}" for name, value in targets) + " |")
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
        "sted": values.sted or 0.0,
        "rmse_diag": values.rmse_diag or 0.0,
        "max_diag": values.max_diag or 0.0,
        "video": share,
        "encode": report.seconds["encode"],
        "fps": source.n_frames / seconds,
    }


def at(rows: list[Row], name: str, error: float) -> str:
    """Return the rate at an error of that name, interpolated between the logarithms of both; nothing is extrapolated."""
    ordered = sorted(rows, key=lambda row: row[name])
    errors = np.array([row[name] for row in ordered])
    if errors[0] > error:
        return f"not reached (best {errors[0]:.2g})"
    if errors[-1] < error:
        return f"<= {ordered[-1]['bpvf']:.3f} ({errors[-1]:.2g})"
    rates = np.array([row["bpvf"] for row in ordered])
    return f"{np.exp(np.interp(np.log(error), np.log(errors), np.log(rates))):.3f}"


if __name__ == "__main__":
    main()
