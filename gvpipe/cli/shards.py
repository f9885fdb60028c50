"""What `info` prints of shards."""

from __future__ import annotations

from gvpipe.cli.console import Output


def show_shards(source: str, unlimited: bool, out: Output) -> None:
    """Sum up shards, and check every sample in them; raises as `gvpipe.datasets.summarise`."""
    from gvpipe.datasets.summary import summarise
    from gvpipe.foundation.notes import count

    with out.progress() as progress:
        found = summarise(source, progress, unlimited=unlimited)
    out.json(found.to_json())
    n_shards = "" if found.shards == 1 else f" in {found.shards} shards"
    codecs = ", ".join(f"{number} {name}" for name, number in found.codecs.items())
    out.text(f"{source}: {count(found.sequences, 'sequence')}{n_shards} ({codecs})")
    for name, counts in (("vertices", found.vertices), ("frames", found.frames)):
        out.text(f"{name}: {counts['least']} to {counts['most']}, {counts['all']} in all")
    out.text(f"triangles: {found.triangles} in all")
    out.text(f"{found.bytes} bytes, {found.video_bytes} of them geometry videos: 1/{found.ratio:.1f} of float32 positions")
    if not found.worst:
        out.text("errors: none are stated; pack NAME.json beside NAME.mp4, as gvpipe compare --json prints it")
    for name, worst in found.worst.items():
        out.text(f"worst {name}: {worst['value']:.4g}, sample {worst['sample']}")
