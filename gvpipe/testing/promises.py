"""What every codec promises, each as a function that raises where it is broken."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.api import decode, encode, open
from gvpipe.coding.codec import Codec
from gvpipe.coding.registry import codec_class, encode_sequence, open_reader
from gvpipe.container import mp4
from gvpipe.foundation.arrays import Float32
from gvpipe.foundation.errors import FormatError, NewerVersion, SettingError
from gvpipe.metrics.comparison import compare
from gvpipe.model.sequence import MeshSequence
from gvpipe.testing.sequences import awkward, held, partly_still, same_triangles, waving
from gvpipe.trajectory.still_vertices import find_still

QUALITIES = (20, 50, 75, 100)
SLACK = 16  # bytes that a file may move either way where quality asks for nothing yet


class BrokenPromise(AssertionError):
    """A codec does not do what every codec must."""


def expect(holds: bool | np.bool_, message: str) -> None:
    """Raise `BrokenPromise` with the message unless it holds."""
    if not holds:
        raise BrokenPromise(message)


@dataclass(frozen=True)
class Subject:
    """A codec that is tried.

    Args:
        codec: its settings.
        folder: where files are made.
        bound: the largest root mean square error, as a part of frame 0's diagonal, that its default quality may make.
    """

    codec: Codec
    folder: Path
    bound: float = 2e-3

    def with_settings(self, **settings: Any) -> Codec:
        """The codec with other settings; raises `SettingError`."""
        changed: Codec = dataclasses.replace(self.codec, **settings)
        return changed

    def encode(self, sequence: MeshSequence, name: str = "a", target: dict[str, Any] | None = None, **settings: Any) -> Path:
        """Encode a sequence and return the file."""
        path = self.folder / f"{name}.mp4"
        encode(sequence, path, self.with_settings(**settings), **(target or {}))
        return path

    @functools.cached_property
    def file(self) -> Path:
        """The file of a sheet that bends, turns and drifts."""
        return self.encode(waving(), "waving")


@dataclass(frozen=True)
class Promise:
    """One of them.

    Args:
        name: a word or two.
        text: what is promised.
        check: raises `BrokenPromise` where a codec breaks it.
    """

    name: str
    text: str
    check: Callable[[Subject], None]

    def __call__(self, subject: Subject) -> None:
        """Try a codec; raises `BrokenPromise`."""
        self.check(subject)


PROMISES: list[Promise] = []


def _promise(name: str, text: str) -> Callable[[Callable[[Subject], None]], Promise]:
    def add(check: Callable[[Subject], None]) -> Promise:
        promise = Promise(name, text, check)
        PROMISES.append(promise)
        return promise

    return add


@_promise("round trip", "vertices keep their order, triangles their winding, and the default quality its error")
def round_trip(subject: Subject) -> None:
    sequence, decoded = waving(), decode(subject.file)
    expect(decoded.fps == sequence.fps, f"{sequence.fps} frames a second became {decoded.fps}")
    expect(same_triangles(decoded.faces, sequence.faces), "triangles, or their winding, are not those of the source")
    error = compare(sequence, decoded).rmse_diag
    expect(
        error is not None and error < subject.bound, f"the error is {error} of the diagonal; below {subject.bound} is promised"
    )


@_promise("same bytes", "the same input gives the same bytes, also where frames are read lazily")
def same_bytes(subject: Subject) -> None:
    class Lazy:
        def __init__(self, frames: Float32) -> None:
            self.frames, self.shape = frames, frames.shape

        def __getitem__(self, key: Any, /) -> Float32:
            chosen: Float32 = self.frames[key].copy()
            return chosen

    sequence = waving(10, 20)
    lazy = MeshSequence(Lazy(np.asarray(sequence.positions[:])), sequence.faces, sequence.fps)
    first, second, third = (subject.encode(each, "same").read_bytes() for each in (sequence, waving(10, 20), lazy))
    expect(first == second, "the same sequence gave other bytes")
    expect(first == third, "frames that are read lazily gave other bytes")


@_promise("quality", "bytes rise with quality, and the error falls")
def quality(subject: Subject) -> None:
    sequence = waving(16, 24)
    sizes, errors = [], []
    for value in QUALITIES:
        path = subject.encode(sequence, "quality", quality=value)
        sizes.append(path.stat().st_size)
        errors.append(compare(sequence, decode(path)).rmse)
    expect(all(after >= before - SLACK for before, after in pairwise(sizes)), f"bytes {sizes} do not rise")
    expect(errors == sorted(errors, reverse=True), f"errors {errors} do not fall")
    expect(
        sizes[-1] > 1.15 * sizes[0] and errors[-1] < 0.5 * errors[0], f"quality changes little: {sizes} bytes, errors {errors}"
    )


def _expect_random_access(path: Path) -> Float32:
    whole: Float32 = open(path)[:]
    video = open(path)
    for frame in np.random.default_rng(0).permutation(len(whole)).tolist():
        expect(np.array_equal(video[frame], whole[frame]), f"frame {frame} alone is another than among all")
    for part in (slice(3, 9), slice(7, 33), slice(30, 3, -5), slice(5, 5)):
        expect(np.array_equal(open(path)[part], whole[part]), f"frames {part} alone are others than among all")
    return whole


@_promise("random access", "any frame alone, in any order, is to the bit what it is among all")
def random_access(subject: Subject) -> None:
    whole, video = _expect_random_access(subject.file), open(subject.file)
    expect(np.array_equal(video[-1], whole[-1]), "the last frame by -1 is another one")
    try:
        video[len(video)]
    except IndexError:
        return
    raise BrokenPromise("a frame after the last one raised no IndexError")


@_promise("segments", "segments decode alone, where the codec has a setting for them")
def segments(subject: Subject) -> None:
    if "segment" not in {field.name for field in dataclasses.fields(subject.codec)}:
        return
    sequence = waving()
    path = subject.encode(sequence, "segments", segment=11)
    error = compare(sequence, decode(path)).rmse_diag
    expect(error is not None and error < subject.bound, f"in segments, the error is {error} of the diagonal")
    bitstream = mp4.read_file(path)
    own = {name: data for name, data in bitstream.sections.items() if not name[-1].isdigit() or name.endswith(".2")}
    expect(len(own) < len(bitstream.sections), "no section is named by its segment, such as coefficients.2")
    alone = open_reader(dataclasses.replace(bitstream, sections=own))
    expect(np.array_equal(alone.read(21, 29), open(path)[21:29]), "segment 2 decodes to others without the other sections")


@_promise("awkward input", "one vertex, no triangle, loose, tiny, huge and still meshes come back")
def awkward_inputs(subject: Subject) -> None:
    for sequence in awkward().values():
        awkward_input(subject, sequence, reorder=False)


def awkward_input(subject: Subject, sequence: MeshSequence, reorder: bool) -> None:
    """Try one of `awkward`; with ``reorder``, the codec may give back another order of vertices."""
    name = sequence.name
    given: dict[str, Any] = {"reorder": True} if reorder else {}
    decoded = decode(subject.encode(sequence, "awkward", quality=90, **given))
    frames, source = np.asarray(decoded.positions[:], np.float64), np.asarray(sequence.positions[:], np.float64)
    expect(frames.shape == source.shape, f"{name}: {source.shape} positions became {frames.shape}")
    expect(len(decoded.faces) == len(sequence.faces), f"{name}: {len(sequence.faces)} triangles became {len(decoded.faces)}")
    extent = float(np.ptp(source, axis=(0, 1)).max())
    allowed = 0.02 * extent + 1e-6 * np.abs(source).max()
    if not reorder:
        expect(same_triangles(decoded.faces, sequence.faces), f"{name}: other triangles")
        error = np.abs(frames - source).max()
        expect(error <= allowed, f"{name}: a coordinate is off by {error:g}; {allowed:g} is allowed at quality 90")
    elif len(sequence.faces):  # the same triangles in space, whatever their order
        ours, theirs = (each.positions[:1][0][each.faces].mean(axis=1) for each in (sequence, decoded))
        distance = np.linalg.norm(ours[:, None].astype(float) - theirs[None], axis=2)
        expect(distance.min(axis=1).max() <= allowed, f"{name}, reordered: a triangle is somewhere else")


@_promise("stillness", "vertices that stand still do so to the bit, with a bound and without")
def stillness(subject: Subject) -> None:
    for bound in (None, "0.2%"):
        still_vertices(subject, bound)


def still_vertices(subject: Subject, bound: str | None) -> None:
    """Try a sheet half of which stands still, with a largest error or none."""
    sequence = partly_still()
    still = find_still(sequence)
    path = subject.encode(sequence, "still", {"max_error": bound} if bound else {})
    frames = _expect_random_access(path)
    expect((frames[:, still] == frames[:1, still]).all(), f"vertices that stand still move (max_error {bound})")
    expect((frames[:, ~still] != frames[:1, ~still]).any(axis=(0, 2)).mean() > 0.9, "vertices that move stand still")
    source = np.asarray(sequence.positions[:], np.float64)
    diagonal = np.linalg.norm(np.ptp(source[0], axis=0))
    error, allowed = np.linalg.norm(frames - source, axis=2).max() / diagonal, 0.002 if bound else 0.01
    expect(error < allowed, f"a vertex is off by {error:.2%} of the diagonal; {allowed:.1%} is allowed")


@_promise("coincidence", "vertices that lie on each other in all frames come back on each other")
def coincidence(subject: Subject) -> None:
    for bound in (None, "0.2%"):
        coincident_vertices(subject, bound)


def coincident_vertices(subject: Subject, bound: str | None) -> None:
    """Try two copies of a sheet at one place, with a largest error or none."""
    one = partly_still()
    frames = np.asarray(one.positions[:])
    twice = MeshSequence(np.concatenate([frames, frames], axis=1), np.concatenate([one.faces, one.faces + one.n_vertices]))
    decoded = open(subject.encode(twice, "copies", {"max_error": bound} if bound else {}))[:]
    half = one.n_vertices
    expect(np.array_equal(decoded[:, :half], decoded[:, half:]), f"seams open (max_error {bound})")


@_promise("repeated frames", "frames that repeat the one before come back identical")
def repeated_frames(subject: Subject) -> None:
    for bound in (None, "0.2%"):
        held_frames(subject, bound)


def held_frames(subject: Subject, bound: str | None) -> None:
    """Try frames that are held for some time, with a largest error or none."""
    lengths = [3, 1, 1, 2, 1, 1, 1, 9, 1, 1, 4]
    sequence = held(waving(9, len(lengths)), lengths)
    frames = _expect_random_access(subject.encode(sequence, "held", {"max_error": bound} if bound else {}))
    expect(frames.shape == (sum(lengths), 81, 3), f"{sum(lengths)} frames became {len(frames)}")
    same = (frames[1:] == frames[:-1]).all(axis=(1, 2))
    expect(
        np.array_equal(same, np.diff(np.repeat(np.arange(len(lengths)), lengths)) == 0),
        f"which frames repeat is another thing after decoding (max_error {bound})",
    )


@_promise("settings", "values out of range and unknown names are refused by name")
def settings(subject: Subject) -> None:
    wrong: list[dict[str, Any]] = [{"quality": 101}, {"quality": -1}, {"quality": "high"}]
    if hasattr(subject.codec, "segment"):
        wrong += [{"segment": 0}, {"segment": 1.5}]
    for given in wrong:
        name = next(iter(given))
        with _refusal(SettingError, name, f"{name}={given[name]!r}"):
            subject.with_settings(**given)
    kind = codec_class(subject.codec.id)
    with _refusal(SettingError, "quality", "the setting 'qualty'"):
        kind.from_texts({"qualty": "3"})
    expect(kind.from_texts({"quality": "30"}) == kind(quality=30.0), "quality=30 as text is another setting than as a number")


@_promise("newer versions", "files of a newer version of the codec are refused")
def newer_versions(subject: Subject) -> None:
    bitstream = mp4.read_file(subject.file)
    with _refusal(NewerVersion, "upgrade", "a newer version of the codec"):
        open_reader(dataclasses.replace(bitstream, version=bitstream.version + 1))


@_promise("hostile input", "damaged sections raise FormatError, or decode to positions of the right shape")
def hostile_input(subject: Subject) -> None:
    moving = mp4.read_file(subject.file)
    standing = encode_sequence(subject.codec, held(partly_still(), [2, *[1] * 19])).bitstream
    rng = np.random.default_rng(1)
    for bitstream in (moving, standing):
        for name, section in bitstream.sections.items():
            for damaged in _damaged(section, rng):
                sections = {**bitstream.sections, name: damaged}
                try:
                    positions = open_reader(dataclasses.replace(bitstream, sections=sections)).read(0, 12)
                except FormatError:
                    continue
                except Exception as exc:
                    raise BrokenPromise(f"a damaged section {name!r} raised {exc!r}; raise CorruptFile") from exc
                expect(
                    positions.shape == (12, bitstream.n_vertices, 3),
                    f"a damaged section {name!r} gave positions {positions.shape}",
                )


def _damaged(section: bytes, rng: np.random.Generator) -> Iterator[bytes]:
    for _ in range(12 if section else 0):
        changed = bytearray(section)
        for at in rng.integers(0, len(section), 2):
            changed[at] = rng.integers(256)
        yield bytes(changed[: rng.integers(1, len(changed) + 1)])


@contextmanager
def _refusal(error: type[Exception], word: str, what: str) -> Iterator[None]:
    """Raise `BrokenPromise` unless what runs inside raises the error, with the word in its message."""
    try:
        yield
    except error as exc:
        expect(word in str(exc), f"the message about {what} does not say {word!r}: {exc}")
    else:
        raise BrokenPromise(f"{what} is not refused; raise {error.__name__}")
