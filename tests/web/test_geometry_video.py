"""The module in a browser: its positions are those of Python, and its errors name the cause."""

from __future__ import annotations

import base64
import dataclasses
import re
import shutil
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import browsers
import numpy as np
import numpy.typing as npt
import pytest
from folders import DATA, DOCS, GOLDEN
from pages import FAST, FRAMES, check_frames, encode_file, flipped, run
from sequences import awkward, held, patched, rigid, waving

import gvpipe
from gvcodecs.mcgv.base.surface import read_surface
from gvcodecs.mcgv.header import Header
from gvpipe.coding.corrections.bound import Bound, encode_corrections
from gvpipe.coding.registry import make_codec, open_reader
from gvpipe.coding.repeated_frames import RepeatedFrames, add_repeated_frames
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.mp4 import BOX_UUID, read_file, write_file
from gvpipe.foundation.errors import CorruptFile
from gvpipe.model.sequence import MeshSequence

pytestmark = pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing())
slow = pytest.mark.slow  # the default run has one test of exact positions and one of the player
PLAYER_PAGE = (DOCS / "player.md").read_text("utf-8")
SAMBA = DATA / "samba.npz"
KINDS: dict[str, dict[str, Any]] = {  # how vertices move, and where their pixels are: all that a file may be
    "affine": {"prediction": "affine", "placement": "charts"},
    "affine-halves": {"prediction": "affine", "placement": "halves"},
    "blended": {"prediction": "blended", "placement": "halves"},
    "blended-charts": {"prediction": "blended", "placement": "charts"},
    "tiles": {"prediction": "blended", "placement": "tiles"},
    "outliers": {"prediction": "affine", "clusters": 1, "quality": 100},
}
LARGEST_ERROR = 0.001  # model units, of the file with corrections
LENGTHS = [2] * 13 + [9]  # frames that each picture is shown for, where frames repeat
Mask = npt.NDArray[np.bool_]


@slow
@pytest.mark.parametrize("kind", KINDS)
def test_frames_of_a_sample_equal_pythons(kind: str, module: Callable[..., Any], site: tuple[Path, str], samples: Path) -> None:
    gvpipe.encode(samples / "creature.npz", site[0] / "creature.mp4", preset="fast", **KINDS[kind])
    check_frames(module, site[0] / "creature.mp4")


@slow
@pytest.mark.skipif(not SAMBA.exists(), reason="no ../shared/data")
@pytest.mark.parametrize("kind", ["affine", "blended", "tiles"])
def test_frames_of_samba_equal_pythons(kind: str, module: Callable[..., Any], site: tuple[Path, str]) -> None:
    gvpipe.encode(SAMBA, site[0] / "samba.mp4", preset="veryfast", **KINDS[kind])
    check_frames(module, site[0] / "samba.mp4")


@slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("sequence", awkward().values(), ids=lambda sequence: sequence.name)
def test_frames_of_awkward_inputs_equal_pythons(
    sequence: MeshSequence, kind: str, module: Callable[..., Any], site: tuple[Path, str]
) -> None:
    check_frames(module, encode_file(site, sequence, **KINDS[kind]))


@slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("reorder", [False, True])
def test_frames_of_seams_and_still_vertices_equal_pythons(
    reorder: bool, kind: str, module: Callable[..., Any], site: tuple[Path, str]
) -> None:
    """Slots are fewer than vertices: pixels, weights and outliers are theirs, and some vertices have none."""
    path = encode_file(site, patched(), reorder=reorder, **KINDS[kind])
    bitstream = read_file(path)
    header = Header.of(bitstream)
    surface = read_surface(bitstream, header)
    assert surface.n_slots < len(surface.vertices) < bitstream.n_vertices
    assert header.outliers or kind != "outliers"
    check_frames(module, path)


@slow
@pytest.mark.parametrize("kind", KINDS)
def test_frames_of_what_never_moves_equal_pythons(kind: str, module: Callable[..., Any], site: tuple[Path, str]) -> None:
    """One distinct frame; and, where the codec is asked directly, nothing but still points."""
    sequence, path = patched(still=1.0), site[0] / "x.mp4"
    check_frames(module, encode_file(site, sequence, **KINDS[kind]))
    write_file(make_codec("mcgv", {**FAST, **KINDS[kind]}).encode(sequence).bitstream, path)
    assert "still" in read_file(path).sections
    check_frames(module, path)


@pytest.mark.parametrize("lengths", [pytest.param([1] * 60, marks=slow), [3, *[1] * 58, 5]], ids=["", "held"])
@pytest.mark.parametrize("settings", [pytest.param({}, marks=slow), {"segment": 25, "reorder": True}], ids=str)
def test_frames_without_pictures_equal_pythons(
    settings: dict[str, Any], lengths: list[int], module: Callable[..., Any], site: tuple[Path, str]
) -> None:
    gvpipe.encode(held(rigid(), lengths), site[0] / "x.mp4", **settings)
    assert read_file(site[0] / "x.mp4").header["pictures"] is False
    check_frames(module, site[0] / "x.mp4")


def test_a_file_without_pictures_plays(module: Callable[..., Any], site: tuple[Path, str]) -> None:
    gvpipe.encode(rigid(), site[0] / "x.mp4")
    shown = module(
        """const video = await GeometryVideo.load(args[0]);
        const shown = [];
        await new Promise((ended, failed) => video.play((_, k) => shown.push(k), { rate: 4, ended, failed }));
        video.close();
        return shown;""",
        "x.mp4",
    )
    assert shown == sorted(shown) and shown[0] == 0 and shown[-1] == 59


@pytest.mark.parametrize(
    "fps", [pytest.param(fps, marks=[] if fps == 29.97 else slow) for fps in (0.5, 12.0, 29.97, 59.94, 240.0)]
)
def test_frames_at_any_rate(fps: float, module: Callable[..., Any], site: tuple[Path, str]) -> None:
    check_frames(module, encode_file(site, dataclasses.replace(waving(8, 30), fps=fps)))


@slow
@pytest.mark.parametrize("kind", KINDS)
def test_frames_of_several_segments_in_the_codecs_order(kind: str, module: Callable[..., Any], site: tuple[Path, str]) -> None:
    settings = {"segment": 11, "reorder": True, "quality": 95, **KINDS[kind]}
    check_frames(module, encode_file(site, waving(10, 50), **settings))


@slow
@pytest.mark.parametrize("kind", ["affine-halves", "blended", "tiles"])
def test_frames_on_the_finest_lattice(kind: str, module: Callable[..., Any], site: tuple[Path, str]) -> None:
    """Where integers are largest: sums that decide pixels and contexts must be exact still."""
    check_frames(module, encode_file(site, waving(20, 12), base_bits=20, quality=100, **KINDS[kind]))


@slow
def test_frames_are_corrected(module: Callable[..., Any], site: tuple[Path, str], kinds: dict[str, Bitstream]) -> None:
    """Files with a bound on every vertex keep it in the browser: all frames, over several groups of corrections."""
    sequence, bitstream = patched(), kinds["corrected"]
    write_file(bitstream, site[0] / "corrected.mp4")
    check_frames(module, site[0] / "corrected.mp4")
    frames = module(FRAMES, "corrected.mp4", [*range(12)])["frames"]
    found = np.stack([np.frombuffer(base64.b64decode(text), "<f4").reshape(-1, 3) for text in frames])
    plain = open_reader(kinds["patched"]).read(0, 12)
    before, after = (np.linalg.norm(sequence.positions[:] - p, axis=2).max() for p in (plain, found))
    assert after <= LARGEST_ERROR < before


@slow
@pytest.mark.parametrize("bound", [None, "0.02%"], ids=["", "max-error"])
@pytest.mark.parametrize("kind", KINDS)
def test_repeated_frames_equal_pythons(
    kind: str, bound: str | None, module: Callable[..., Any], site: tuple[Path, str]
) -> None:
    """Every frame twice, the last held: the file codes each once, and so do its segments and corrections."""
    sequence = held(waving(9, len(LENGTHS)), LENGTHS)
    path = encode_file(site, sequence, segment=6, max_error=bound, **KINDS[kind])
    assert {"holds", *(["corrections"] if bound else [])} <= set(read_file(path).sections)
    check_frames(module, path, count=sum(LENGTHS))


def test_frames_of_golden_files(module: Callable[..., Any], site: tuple[Path, str]) -> None:
    versions = set()
    for path in sorted(GOLDEN.glob("mcgv-*.mp4")):
        bitstream = read_file(path)
        if bitstream.header.get("profile", "h264-8") == "h264-8" and "transform" not in bitstream.header:
            versions.add(bitstream.version)
            shutil.copy(path, site[0])
            check_frames(module, site[0] / path.name, gvpipe.read(path.with_suffix(".npz")))
    assert versions == {1}


@slow
def test_bounds_hold_what_never_moves(module: Callable[..., Any], site: tuple[Path, str]) -> None:
    path = encode_file(site, patched(), prediction="blended")
    bounds = module(FRAMES, path.name, [0])["bounds"]
    positions = np.asarray(gvpipe.decode(path).positions[:])
    still = (positions == positions[0]).all(axis=(0, 2))
    assert still.any() and not still.all()
    assert (bounds["min"] <= positions[0, still].min(axis=0)).all()
    assert (bounds["max"] >= positions[0, still].max(axis=0)).all()


@slow
@pytest.mark.parametrize("kind", ["affine", "blended"])
def test_bounds_hold_the_motion(kind: str, module: Callable[..., Any], site: tuple[Path, str]) -> None:
    path = encode_file(site, waving(), quality=95, **{"clusters": 12, **KINDS[kind]})
    bounds = module(FRAMES, path.name, [0])["bounds"]
    positions = np.asarray(gvpipe.decode(path).positions[:])
    low, high = positions.min(axis=(0, 1)), positions.max(axis=(0, 1))
    slack = 0.2 * np.linalg.norm(high - low)
    assert (bounds["min"] <= low + 0.02).all() and (bounds["min"] >= low - slack).all()
    assert (bounds["max"] >= high - 0.02).all() and (bounds["max"] <= high + slack).all()


@slow
def test_module_plays_every_frame_that_is_due(module: Callable[..., Any], site: tuple[Path, str]) -> None:
    path = encode_file(site, waving(10, 24))
    frames, matches = module(
        """const video = await GeometryVideo.load(args[0]);
        const played = new Map();
        await new Promise((resolve, reject) =>
          video.play((positions, k) => played.set(k, positions.slice()), { rate: 0.5, ended: resolve }).catch(reject));
        let matches = 0;
        for (const [k, positions] of played) if ((await video.frame(k)).every((x, i) => x === positions[i])) matches++;
        return [[...played.keys()], matches];""",
        path.name,
    )
    assert frames == sorted(set(frames))
    assert len(frames) >= 8  # of 24; on an idle machine all
    assert matches == len(frames)


@slow
@pytest.mark.parametrize("decoder", ["", "delete window.VideoDecoder;"], ids=["webcodecs", "video"])
def test_repeated_frames_play_in_order(decoder: str, module: Callable[..., Any], site: tuple[Path, str]) -> None:
    """From a frame sought to the end, at the sequence's own pace; each with its own positions."""
    path = encode_file(site, held(waving(10, len(LENGTHS)), LENGTHS))
    shown, wrong, seconds, after = module(
        decoder
        + """const video = await GeometryVideo.load(args[0]);
        const wanted = [];
        for (let k = 0; k < video.frameCount; k++) wanted.push(await video.frame(k));
        const same = (positions, k) => positions.every((x, i) => x === wanted[k][i]);
        await video.frame(5);
        const [shown, wrong] = [[], []];
        const start = performance.now();
        const show = (positions, k) => (shown.push(k), same(positions, k) || wrong.push(k));
        await new Promise((resolve, reject) => video.play(show, { ended: resolve, failed: reject }).catch(reject));
        const seconds = (performance.now() - start) / 1000;
        const after = [];
        for (const k of [34, 26, 25, 0, 13, 12]) after.push(same(await video.frame(k), k));
        return [shown, wrong, seconds, after];""",
        path.name,
    )
    assert shown == sorted(set(shown)) and shown[0] in range(5, 12) and shown[-1] == sum(LENGTHS) - 1, shown
    assert len(shown) >= 10  # of 30; on an idle machine all
    assert not wrong and all(after), (wrong, after)
    assert seconds > 0.8 * 30 / 24


@slow
def test_playing_begins_with_the_frame_sought(module: Callable[..., Any], site: tuple[Path, str]) -> None:
    """Whatever the clock says: 1232.4 ms - 5 / 24 s + 5 / 24 s is less than 1232.4 ms in floating point."""
    path = encode_file(site, held(waving(10, len(LENGTHS)), LENGTHS))
    first = module(
        """delete window.VideoDecoder;
        const video = await GeometryVideo.load(args[0]);
        const first = [];
        for (const start of args[1]) {
          await video.frame(5);
          let now = start;
          const nextTick = (tick) => setTimeout(() => tick((now += 1000 / 60)));
          const show = (positions, k) => (video.pause(), first.push(k));
          await new Promise((resolve, reject) => video.play((p, k) => (show(p, k), resolve()), { nextTick }).catch(reject));
        }
        return first;""",
        path.name,
        [1232.4 - 1000 / 60, 1233.0 - 1000 / 60, 1233.3 - 1000 / 60],
    )
    assert first == [5, 5, 5]


@slow
def test_overlapping_requests_are_answered_in_turn(module: Callable[..., Any], site: tuple[Path, str]) -> None:
    path = encode_file(site, waving(10, 24))
    same = module(
        """const video = await GeometryVideo.load(args[0]);
        const together = await Promise.all([20, 3, 11, 0].map((k) => video.frame(k)));
        const outside = await video.frame(24).catch((error) => error.name);
        const alone = [];
        for (const k of [20, 3, 11, 0]) alone.push(await video.frame(k));
        return [alone.every((frame, i) => frame.every((x, j) => x === together[i][j])), outside];""",
        path.name,
    )
    assert same == [True, "RangeError"]


def _remuxed(data: bytes) -> bytes:
    """The video and its tags without gvpipe's box."""
    size = 0
    while data[size + 4 : size + 8] != b"uuid":
        size += struct.unpack_from(">I", data, size)[0]
    return data[:size]


def _with_version(data: bytes, version: int) -> bytes:
    """A file whose payload begins with another version."""
    at = data.rindex(BOX_UUID.bytes) + 16
    return data[:at] + bytes([version]) + data[at + 1 :]


BROKEN: dict[str, tuple[str, Callable[[bytes], bytes]]] = {
    "empty": ("truncated", lambda data: b""),
    "half": ("truncated", lambda data: data[: len(data) // 2]),
    "one byte short": ("truncated", lambda data: data[:-1]),
    "no MP4": ("not-geometry-video", lambda data: b"<!doctype html><p>Not found</p>"),
    "stripped": ("stripped", _remuxed),
    "foreign": ("not-geometry-video", lambda data: _remuxed(data).replace(b"gvpipe 2 ", b"someone 2")),
    "newer": ("newer", lambda data: _with_version(data, 3)),
    "newer by its tag": ("newer", lambda data: data.replace(b"gvpipe 2 ", b"gvpipe 3 ")),
    "stray bytes": ("corrupt", lambda data: data + bytes(16)),
    "last section": ("corrupt", lambda data: flipped(data, len(data) - 5)),
    "no version": ("corrupt", lambda data: _with_version(data, 255)),
    "header": ("corrupt", lambda data: flipped(data, data.rindex(BOX_UUID.bytes) + 24)),
    "picture": ("corrupt", lambda data: flipped(data, data.index(b"mdat") + 100)),
}


@slow
@pytest.mark.parametrize("case", BROKEN)
def test_broken_files_are_told_apart(case: str, module: Callable[..., Any], site: tuple[Path, str], video_bytes: bytes) -> None:
    kind, damage = BROKEN[case]
    (site[0] / "broken.mp4").write_bytes(damage(video_bytes))
    found = module(
        """const load = GeometryVideo.load(args[0]);
        return load.then(() => "loaded", (e) => [e instanceof GeometryVideoError, e.kind, e.message])""",
        "broken.mp4",
    )
    assert found[:2] == [True, kind], found
    assert "\n" not in found[2]


@slow
def test_a_damaged_index_gives_one_clear_error(module: Callable[..., Any], site: tuple[Path, str], video_bytes: bytes) -> None:
    """No checksum covers the video's tables: whatever they hold, the file opens or there is one error of ours."""
    first, end = video_bytes.index(b"stbl"), video_bytes.index(b"mdat")
    positions = np.random.default_rng(5).integers(first, end - 8, 60).tolist()
    for kind in (b"stsz", b"stco", b"stsc", b"stts", b"ctts", b"stss"):
        if kind in video_bytes:
            positions += [video_bytes.index(kind) + offset for offset in (8, 9, 11, 15)]  # numbers of rows, and the first row
    for i, position in enumerate(positions):
        (site[0] / f"i{i}.mp4").write_bytes(flipped(video_bytes, position))
    outcomes = module(
        """const outcomes = [];
        for (let i = 0; i < args[0]; i++) {
          const outcome = await GeometryVideo.load(`i${i}.mp4`).then((video) => (video.close(), "loaded"),
            (error) => (error instanceof GeometryVideoError ? error.kind : String(error.stack)));
          outcomes.push(outcome);
        }
        return outcomes;""",
        len(positions),
    )
    assert set(outcomes) <= {"loaded", "corrupt", "unsupported", "not-geometry-video"}, outcomes
    assert outcomes.count("corrupt") > 10


@slow
def test_a_file_that_is_not_there(module: Callable[..., Any]) -> None:
    for address in ("nothing.mp4", "http://127.0.0.1:9/x.mp4"):
        assert module("return GeometryVideo.load(args[0]).catch((error) => error.kind)", address) == "load"


@slow
def test_files_not_for_browsers_say_so(module: Callable[..., Any], site: tuple[Path, str]) -> None:
    gvpipe.encode(waving(6, 5), site[0] / "other.mp4", codec="mcgv")
    bitstream = read_file(site[0] / "other.mp4")
    write_file(dataclasses.replace(bitstream, version=bitstream.version + 1), site[0] / "other.mp4")
    kind, message = module("return GeometryVideo.load(args[0]).catch((error) => [error.kind, error.message])", "other.mp4")
    assert kind == "newer"
    assert "newer" in message


@slow
@pytest.mark.parametrize(("field", "value"), [("n_frames", 12), ("n_frames", 1 << 24), ("n_vertices", 71), ("n_triangles", 1)])
def test_counts_that_do_not_fit_are_noticed(
    field: str, value: int, module: Callable[..., Any], site: tuple[Path, str], video: Path
) -> None:
    changed: dict[str, Any] = {field: value}
    write_file(dataclasses.replace(read_file(video), **changed), site[0] / "counts.mp4")
    assert module("return GeometryVideo.load(args[0]).catch((error) => error.kind)", "counts.mp4") == "corrupt"


@pytest.fixture(scope="module")
def kinds(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Bitstream]:
    """A small file of each kind."""
    path = tmp_path_factory.mktemp("kinds") / "x.mp4"
    found = {}
    for kind, settings in KINDS.items():
        gvpipe.encode(waving(9, 12), path, **{**FAST, **settings})
        found[kind] = read_file(path)
    sequence = patched()
    gvpipe.encode(sequence, path, **{**FAST, "prediction": "blended"})
    found["patched"] = plain = read_file(path)
    bound = Bound.of(LARGEST_ERROR, float(np.abs(sequence.positions[:]).max()))
    section, _ = encode_corrections(sequence, open_reader(plain), bound)
    found["corrected"] = dataclasses.replace(plain, sections={**plain.sections, "corrections": section})
    gvpipe.encode(held(waving(9, len(LENGTHS)), LENGTHS), path, **FAST)
    found["held"] = read_file(path)
    gvpipe.encode(waving(9, 12), path, preset="ultrafast", quality=30)
    found["calm"] = read_file(path)
    assert "outliers" not in found["calm"].sections
    return found


@slow
@pytest.mark.parametrize(
    ("kind", "settings"),
    [
        ("affine", {"width": 16}),
        ("affine", {"height": 0}),
        ("affine", {"block": 7}),
        ("affine", {"clusters": 2000}),
        ("affine", {"segments": 99}),
        ("affine", {"base": [0, 0, 1]}),
        ("affine", {"residual_step": -1}),
        ("blended", {"prediction": "guessed"}),
        ("blended", {"prediction": None}),
        ("blended", {"prediction": "affine"}),
        ("blended", {"placement": "anywhere"}),
        ("blended", {"placement": "charts"}),
        ("blended", {"block": 4}),
        ("tiles", {"block": 4}),
        ("tiles", {"prediction": "affine"}),
        ("blended", {"clusters": 1}),
        ("affine-halves", {"prediction": "blended"}),
        ("blended-charts", {"placement": ["charts"]}),
        ("outliers", {"outliers": 1}),
        ("calm", {"outliers": True}),
    ],
    ids=str,
)
def test_settings_out_of_range_are_noticed(
    kind: str, settings: dict[str, Any], module: Callable[..., Any], site: tuple[Path, str], kinds: dict[str, Bitstream]
) -> None:
    bitstream = kinds[kind]
    write_file(dataclasses.replace(bitstream, header={**bitstream.header, **settings}), site[0] / "settings.mp4")
    assert module("return GeometryVideo.load(args[0]).catch((error) => error.kind)", "settings.mp4") == "corrupt"


@slow
@pytest.mark.parametrize(
    ("kind", "section"),
    [
        ("affine", "mesh"),
        ("affine", "order"),
        ("affine", "pixels"),
        ("affine", "clusters"),
        ("affine", "transforms.0"),
        ("affine-halves", "clusters"),
        ("blended", "mesh"),
        ("blended", "weights"),
        ("blended", "transforms.0"),
        ("tiles", "charts"),
        ("corrected", "corrections"),
        ("outliers", "outliers"),
        ("patched", "mesh"),
        ("patched", "order"),
        ("patched", "still"),
        ("patched", "weights"),
        ("held", "holds"),
    ],
)
def test_hostile_sections_give_one_clear_error(
    kind: str, section: str, module: Callable[..., Any], site: tuple[Path, str], kinds: dict[str, Bitstream]
) -> None:
    """Sections changed, cut or lengthened under right checksums: JavaScript's own checks, and no other error ever."""
    bitstream = kinds[kind]
    data = bitstream.sections[section]
    rng = np.random.default_rng(11)
    variants = [b"", data[: len(data) // 2], data[:-1], data + b"\0", bytes(len(data)), b"\xff" * len(data)]
    variants += [flipped(data, int(position)) for position in rng.integers(0, len(data), 40)]
    wanted = []
    for i, variant in enumerate(variants):
        path = site[0] / f"h{i}.mp4"
        write_file(dataclasses.replace(bitstream, sections={**bitstream.sections, section: variant}), path)
        wanted.append(_outcome(path))
    outcomes = module(
        """const outcomes = [];
        for (let i = 0; i < args[0]; i++) {
          const outcome = await GeometryVideo.load(`h${i}.mp4`).then((video) => (video.close(), "loaded"),
            (error) => (error instanceof GeometryVideoError ? error.kind : String(error.stack)));
          outcomes.push(outcome);
        }
        return outcomes;""",
        len(variants),
    )
    assert set(outcomes) <= {"loaded", "corrupt"}, [outcome for outcome in outcomes if outcome not in ("loaded", "corrupt")]
    assert outcomes[2] == "corrupt"  # cut short
    differing = [(i, found, python) for i, (found, python) in enumerate(zip(outcomes, wanted, strict=True)) if found != python]
    assert not differing, differing  # JavaScript refuses what Python refuses


@slow
@pytest.mark.parametrize("lengths", [[5, 0, 7], [3, 4], [14, -2], [1] * 13, [1 << 38, 5], [12], [6, 6], []], ids=str)
def test_wrong_holds_are_refused(
    lengths: list[int], module: Callable[..., Any], site: tuple[Path, str], kinds: dict[str, Bitstream]
) -> None:
    """Runs that do not add up to the header's frames, or that are not of as many pictures as the video has."""
    plain = kinds["blended"]
    wrong = add_repeated_frames(plain, RepeatedFrames(np.array(lengths, np.int64)))
    path = site[0] / "holds.mp4"
    write_file(dataclasses.replace(wrong, n_frames=plain.n_frames), path)
    assert _outcome(path) == "corrupt"
    assert module("return GeometryVideo.load(args[0]).catch((error) => error.kind)", path.name) == "corrupt"


def _outcome(path: Path) -> str:
    try:
        sequence = gvpipe.decode(path)
        sequence.read(0, sequence.n_frames)
    except CorruptFile:
        return "corrupt"
    return "loaded"


@slow
def test_the_module_as_the_docs_show_it(module: Callable[..., Any], browser: Any, site: tuple[Path, str]) -> None:
    encode_file(site, waving(10, 24), "walk.mp4")
    (script,) = (each for each in re.findall(r"```js\n(.*?)```", PLAYER_PAGE, re.DOTALL) if "GeometryVideo.load" in each)
    drawn = "window.draw = (positions, indices) => { window.drawn = [positions.length, indices.length] };"
    (site[0] / "docs.html").write_text(f"<!doctype html><script>{drawn}</script><script type=module>{script}</script>")
    browser.get(f"{site[1]}/docs.html")
    wait = "while (!window.drawn) await new Promise((resolve) => setTimeout(resolve, 50)); return window.drawn;"
    assert run(browser, wait) == [300, 3 * 162]
