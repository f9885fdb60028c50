"""What a run gives mutated files to: its options, and the parsers that they choose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from fuzz.parts import Target


@dataclass(frozen=True)
class Options:
    """What is run.

    Args:
        seconds: of the clock, without those in which kernels are compiled and loaded.
        cases: of each target, instead of a time; 0: as many as there is time for.
        seed: of the random numbers.
        targets: names of parsers; none: all.
        without: names of parsers that are left out.
        kind: ``video`` (Python's parsers of geometry videos), ``mesh``, ``web`` (the player's), ``strange`` (names, answers of
            servers, files of machine code); "": all.
        workers: processes.
        seeds: folder of the seed files.
        found: folder for cases that fail.
        folder: where a worker writes its case.
        more: a folder of further mesh files, as seeds.
        first: number of the first case of each target.
        indices: whether kernels refuse indices out of bounds and negative ones.
        longest: seconds of processor time after which a case counts as hung.
        loader: what makes the targets.
    """

    seconds: float
    cases: int = 0
    seed: int = 1
    targets: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    kind: str = ""
    workers: int = 2
    seeds: str = ""
    found: str = ""
    folder: str = ""
    more: str = ""
    first: int = 0
    indices: bool = False
    longest: int = 20
    loader: Callable[[Options], list[Target]] | None = None


def load_targets(options: Options) -> list[Target]:
    """The parsers that are asked for, with their seeds."""
    if options.loader is not None:
        return options.loader(options)
    from fuzz.browser import browser_targets
    from fuzz.captures import capture_target
    from fuzz.companions import companion_seeds, companion_target
    from fuzz.live import live_target
    from fuzz.mesh_files import mesh_targets
    from fuzz.seeds import ROOT, TESTS, load_captures, load_live, load_seeds
    from fuzz.shards import shard_seeds, shard_target
    from fuzz.strange import strange_targets
    from fuzz.streams import stream_target
    from fuzz.videos import video_targets

    if options.indices:
        from fuzz.strict_indices import refuse_bad_indices

        refuse_bad_indices()
    videos, streams, meshes = load_seeds(Path(options.seeds), Path(options.more) if options.more else None)
    growing, captures = load_live(Path(options.seeds)), load_captures(Path(options.seeds))
    shards = shard_seeds([TESTS / "golden" / f"{name}.mp4" for name in ("pca-1-kalman", "pca-1-still", "pdct-1")])
    kinds = {
        "video": [
            *video_targets(videos),
            stream_target(streams),
            live_target(growing),
            shard_target(shards),
            companion_target(companion_seeds(TESTS / "golden" / "pdct-1.mp4", ROOT / "samples" / "voice.wav")),
            capture_target(captures),
        ],
        "mesh": mesh_targets(meshes),
        "web": browser_targets(videos, streams, growing, captures),
        "strange": strange_targets((TESTS / "golden" / "pdct-1.mp4").read_bytes()),
    }
    targets = [target for kind, group in kinds.items() if options.kind in ("", kind) for target in group]
    unknown = {*options.targets, *options.without} - {target.name for target in targets}
    if unknown:
        raise KeyError(f"no target {', '.join(sorted(unknown))}; there are {', '.join(target.name for target in targets)}")
    wanted = set(options.targets or [target.name for target in targets]) - set(options.without)
    return [target for target in targets if target.name in wanted]
