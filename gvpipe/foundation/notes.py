"""What was done that a user should know, though nothing is wrong: one line each.

Readers put notes on the sequence (`MeshSequence.notes`), `gvpipe.encode` adds its own (`Report.notes`), the command line prints
them. The library itself never prints.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

ROUNDED = 1e-5  # part of the diagonal: what float32 may round without a word
DEFAULT_FPS = 30.0
MOST_NAMED = 12  # names in a note
MUCH_SOUND = 0.1  # seconds between the ends of a sound and of its film: what is said
ASSUMED_FPS = f"the input has no frame rate; {DEFAULT_FPS:g} frames per second were assumed (fps, --fps)"


def count(number: int, noun: str, several: str = "") -> str:
    """``1 frame``, ``2 frames``; ``several`` is what no s makes of a noun."""
    return f"{number} {noun if number == 1 else several or noun + 's'}"


def shape(n_frames: int, n_vertices: int) -> str:
    """``24 frames, 300 vertices``."""
    return f"{count(n_frames, 'frame')}, {count(n_vertices, 'vertex', 'vertices')}"


def one_of_many(name: str, count: int, choice: str) -> str:
    """The note for a single file that looks like one frame of many; ``choice`` would name them all."""
    return f"{name} is 1 of {count} numbered files and was read alone; all of them are '{choice}'"


def given_order(count: int) -> str:
    """The note for a list of files whose names do not say an order."""
    return f"the names of the {count} files are not one numbered series; they are frames in the order given"


def loose_bound(bound: float, diagonal: float) -> tuple[str, ...]:
    """The note for a largest error that allows everything."""
    if not bound > diagonal > 0:
        return ()
    return (f"the largest error allowed, {bound:g}, is larger than the object, whose diagonal is {diagonal:g}",)


def rounded(rounding: float, diagonal: float) -> tuple[str, ...]:
    """The note for positions that are so far apart that float32 deforms the object, even from the best origin."""
    if not rounding > ROUNDED * diagonal > 0:
        return ()
    part = f"{100 * rounding / diagonal:.2g} % of the object's diagonal"
    return (f"positions reach so far from the first frame's that float32 rounds them by up to {rounding:.2g}, {part}",)


def not_held(format_name: str, names: Sequence[str]) -> tuple[str, ...]:
    """Notes for what a file format has no place for."""
    return (f"{format_name} has no place for {', '.join(names)}; left out (.npz holds everything)",) if names else ()


def whole_numbers(names: Sequence[str]) -> tuple[str, ...]:
    """The note for floats that are kept exactly, since all of them are whole numbers."""
    listed = ", ".join(map(repr, names))
    each = f"a bound, such as {names[0]}=0.1%, keeps them coarser" if names else ""
    return (f"whole numbers alone, so kept exactly: {listed} ({each})",) if names else ()


def shots(name: str, n_meshes: int, n_shots: int, first: int) -> str:
    """That an input of several meshes has become a capture."""
    changes = count(n_meshes - 1, "time")
    is_made = f"the file is a capture of {count(n_shots, 'shot')}"
    return f"{name}: vertices or triangles change {changes}, first at frame {first}; {is_made}"


def not_carried(names: Sequence[str]) -> tuple[str, ...]:
    """The note for attributes that the file has no place for."""
    return (f"the file does not carry {', '.join(names)}",) if names else ()


NO_VOLUME = "there are no volume cells to keep"


def left_behind(names: Sequence[str]) -> tuple[str, ...]:
    """The note for what a source has beside what is read."""
    shown = ", ".join(names[:MOST_NAMED]) + (f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else "")
    remedy = "; --volume carries volume cells" if any(name.startswith("volume cells") for name in names) else ""
    return (f"the source has what is not carried: {shown}{remedy}",) if names else ()


def over_budget(reason: str) -> str:
    """The note for a file that is refused because it is very small for what it holds."""
    return f"the file is so small for its mesh that reading it needs --unlimited ({reason})"


def sound_left_out(reason: str) -> str:
    """The note for a sound that is damaged."""
    return f"the sound is left out: {reason}"


SOUND_ELSEWHERE = "the sound has ended before these frames, or begins after them; the file has none"


def sound_and_film(stop: float, film: float) -> tuple[str, ...]:
    """The note for a sound that ends at another time than the film, seconds."""
    if stop > film + MUCH_SOUND:
        return (f"the sound goes on for {stop - film:.3g} s after the film; players stop there (--audio-trim cuts it)",)
    if stop < film - MUCH_SOUND:
        return (f"the sound ends {film - stop:.3g} s before the film, which goes on in silence",)
    return ()


def coarser_level(lod: int, names: Sequence[str]) -> tuple[str, ...]:
    """The note for what a level of detail has no place for."""
    return (f"level of detail {lod} leaves out {', '.join(names)}",) if names else ()


def origin_left_out(origin: Sequence[float]) -> str:
    """The note for positions that were written without their origin."""
    return f"positions are relative to {show_origin(origin)}, which was left out"


def show_origin(origin: Iterable[float]) -> str:
    """``5200001, 0, -500000``."""
    return ", ".join(f"{x:.17g}" for x in origin)
