"""The fuzzer itself: files are put together as they were, cases repeat, and whatever goes wrong is caught and made small."""

from __future__ import annotations

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import fuzz_targets
import numpy as np
import pytest
from folders import GOLDEN, SAMPLES

import gvpipe
from fuzz import limits
from fuzz.boxes import parse_boxes
from fuzz.browser import Node, RefusedByPlayer
from fuzz.captures import capture_target, split_capture
from fuzz.companions import companion_seeds, companion_target
from fuzz.hdf import mutate_hdf
from fuzz.limits import ACCEPTED, REFUSED, judge
from fuzz.live import live_target, split_live
from fuzz.mesh_files import join_files, mesh_targets, split_files
from fuzz.mutation import mutate_bytes, mutate_json, mutate_text
from fuzz.parts import Seed
from fuzz.reduction import reduce_parts
from fuzz.seeds import load_captures, load_live
from fuzz.session import Session
from fuzz.shards import shard_seeds, shard_target
from fuzz.strange import strange_targets
from fuzz.streams import split_stream, stream_target
from fuzz.targets import Options
from fuzz.videos import FILE, VIDEO, join_video, split_video, video_targets
from fuzz.worker import write_files
from gvpipe.model.sequence import MeshSequence

ASSET = GOLDEN / "pdct-1-asset.mp4"
STILL = GOLDEN / "mcgv-1-still.mp4"
PLAIN = GOLDEN / "layouts" / "plain-mcgv.mp4"  # of container version 2


@pytest.mark.parametrize("path", [ASSET, STILL, PLAIN], ids=lambda path: path.stem)
def test_a_video_put_together_is_the_same(path: Path, tmp_path: Path) -> None:
    parts = split_video(path.read_bytes())
    again = write_files(join_video(parts), tmp_path / "case")
    assert split_video(again.read_bytes()) == parts
    assert np.array_equal(gvpipe.open(again)[:], gvpipe.open(path)[:])
    assert b"".join(box.pack() for box in parse_boxes(parts[VIDEO])) == parts[VIDEO]


def test_a_capture_put_together_is_the_same(tmp_path: Path) -> None:
    seed = load_captures(tmp_path)[0]
    target = capture_target((seed,))
    again = write_files(target.join(seed.parts), tmp_path / "case")
    assert split_capture(again.read_bytes()) == seed.parts and any(name.startswith("shared.") for name in seed.parts)
    with gvpipe.open_capture(again) as found, gvpipe.open_capture(tmp_path / "captures" / f"{seed.name}.mp4") as wanted:
        assert all(np.array_equal(found[k], wanted[k]) for k in range(len(wanted)))
    verdicts = [judge(target, write_files(target.join(target.case(1, k)[1]), tmp_path / "case"), 10**4) for k in range(1, 30)]
    assert {verdict.kind for verdict in verdicts} == {ACCEPTED, REFUSED}, verdicts


def test_a_stream_put_together_is_the_same(tmp_path: Path) -> None:
    gvpipe.restream(STILL, tmp_path / "a.mp4", "stream")
    seed = Seed("still", split_stream((tmp_path / "a.mp4").read_bytes()))
    target = stream_target((seed,))
    again = write_files(target.join(seed.parts), tmp_path / "case")
    assert split_stream(again.read_bytes()) == seed.parts
    assert np.array_equal(gvpipe.open(again)[:], gvpipe.open(STILL)[:])
    verdicts = [judge(target, write_files(target.join(target.case(1, k)[1]), tmp_path / "case"), 10**4) for k in range(1, 30)]
    assert {verdict.kind for verdict in verdicts} == {ACCEPTED, REFUSED}, verdicts


def test_a_file_that_grows_put_together_is_the_same(tmp_path: Path) -> None:
    seed = load_live(tmp_path)[0]
    target = live_target((seed,))
    again = write_files(target.join(seed.parts), tmp_path / "case")
    assert split_live(again.read_bytes()) == seed.parts
    assert np.array_equal(gvpipe.open(again)[:], gvpipe.open(tmp_path / "live" / f"{seed.name}.mp4")[:])
    verdicts = [judge(target, write_files(target.join(target.case(1, k)[1]), tmp_path / "case"), 10**4) for k in range(1, 40)]
    assert {verdict.kind for verdict in verdicts} == {ACCEPTED, REFUSED}, verdicts


@pytest.mark.parametrize("number", [0, 1])  # with all of its sections, and with one beside
def test_a_shard_put_together_is_read(number: int, tmp_path: Path) -> None:
    seed = shard_seeds([GOLDEN / "pca-1-still.mp4"])[number]
    target = shard_target((seed,))
    again = gvpipe.datasets.open(write_files(target.join(seed.parts), tmp_path / "case"))
    assert (
        np.array_equal(again.read("a"), gvpipe.open(GOLDEN / "pca-1-still.mp4")[:])
        and again.description(0)["max_diag"] == 0.001
    )
    verdicts = [judge(target, write_files(target.join(target.case(1, k)[1]), tmp_path / "case"), 10**4) for k in range(1, 30)]
    assert {verdict.kind for verdict in verdicts} == {ACCEPTED, REFUSED}, verdicts


def test_a_sound_put_together_is_read(tmp_path: Path) -> None:
    seeds = companion_seeds(GOLDEN / "pdct-1.mp4", SAMPLES / "voice.wav")
    target = companion_target(seeds)
    again = write_files(target.join(seeds[0].parts), tmp_path / "case")
    sound = gvpipe.open(again).sound
    assert sound is not None and sound.codec == "aac" and abs(sound.seconds - 0.3) < 0.15
    verdicts = [judge(target, write_files(target.join(target.case(1, k)[1]), tmp_path / "case"), 10**4) for k in range(2, 12)]
    assert {verdict.kind for verdict in verdicts} == {ACCEPTED}, verdicts  # the geometry is whole


def test_cases_repeat_and_checksums_hold(tmp_path: Path) -> None:
    """No mutated section is refused by its checksum: it reaches its parser."""
    seeds = (Seed("asset", split_video(ASSET.read_bytes())),)
    targets = {target.name: target for target in video_targets(seeds)}
    groups = {"connectivity", "asset", "attributes", "fields", "images", "pdct"}
    assert set(targets) == {"boxes", "header", "table", "pictures", *groups}
    texts = []
    for name, target in targets.items():
        assert target.case(1, 0)[1] == seeds[0].parts
        files = [target.join(target.case(3, number)[1]) for number in range(1, 4)]
        assert files == [target.join(target.case(3, number)[1]) for number in range(1, 4)]
        assert files != [target.join(target.case(4, number)[1]) for number in range(1, 4)]
        if name in ("attributes", "fields", "pdct"):
            verdicts = [judge(target, write_files(each, tmp_path / "case"), 1) for each in files]
            texts += [verdict.detail for verdict in verdicts if verdict.kind == REFUSED]
    assert texts and not any("checksum does not match" in text for text in texts)


def test_mesh_files(tmp_path: Path, sequence: MeshSequence) -> None:
    names = ["a.npz", "a.glb", "a.pc2"]
    for name in names:
        gvpipe.write(sequence, tmp_path / name)
    gvpipe.write(sequence.part(0, 1), tmp_path / "mesh.obj")
    mesh = {"mesh.obj": (tmp_path / "mesh.obj").read_bytes()}
    for name in names:
        files = {name: (tmp_path / name).read_bytes(), **(mesh if name == "a.pc2" else {})}
        (target,) = mesh_targets({"x": (Seed(name, files),)})
        assert split_files(join_files(target.seeds[0].parts)) == target.seeds[0].parts
        verdict = judge(target, write_files(target.join(target.case(1, 0)[1]), tmp_path / "case"), 10**5)
        assert verdict.kind == ACCEPTED, verdict
        assert target.join(target.case(1, 1)[1]) == target.join(target.case(1, 1)[1])


def test_changes_are_of_any_data() -> None:
    rng = np.random.default_rng(0)
    for change in (mutate_bytes, mutate_text, mutate_json, mutate_hdf):
        for data in (b"", b"x", b"[]", b'{"a": [1, {"b": "c"}]}', b"v 1 2 3\nf 1 2 3\n", bytes(100)):
            changed = [change(data, rng) for _ in range(60)]
            assert all(isinstance(each, bytes) for each in changed) and any(each != data for each in changed)


def test_whatever_goes_wrong_is_found(tmp_path: Path) -> None:
    """Exceptions, promises, costs, endless loops and the death of the process; the run goes on behind each."""
    options = Options(
        seconds=60,
        cases=16,
        seed=1,
        workers=1,
        found=str(tmp_path / "found"),
        folder=str(tmp_path / "case"),
        longest=1,
        loader=fuzz_targets.bad_targets,
    )
    lines: list[str] = []
    session = Session(options, lines.append)
    session.run()
    result = session.to_json()
    count = result["targets"]["bad"]
    kinds = ["accepted", "refused", "crashed", "broken", "slow", "large", "hung"]
    assert count["cases"] == 16 == sum(count[kind] for kind in kinds) and count["refused"] == 1
    wanted = {*fuzz_targets.KINDS.values()} - (set() if sys.platform == "linux" else {"large", "hung"})
    assert wanted <= {finding["kind"] for finding in result["findings"]} and len(lines) == len(result["findings"])
    for finding in result["findings"]:
        kept = Path(finding["folder"], "file").read_bytes()
        assert finding["kind"] == fuzz_targets.KINDS[kept[:1]]


def test_what_is_slow_is_found(tmp_path: Path) -> None:
    (target,) = fuzz_targets.bad_targets(Options(0))
    assert judge(replace(target, seconds=0.0), write_files({"file": b"x"}, tmp_path / "case"), 1).kind == limits.SLOW


def test_a_case_is_made_small() -> None:
    sound = {"a": b"0123456789", "b": b"sound", "c": b"kept"}
    failing = {"a": b"01X34567Y9!", "b": b"other", "d": b"more"}
    small = reduce_parts(sound, failing, lambda parts: b"Y" in parts.get("a", b"") and "c" not in parts)
    assert small == {"a": b"01234567Y9", "b": b"sound"}


INDICES = """
import sys
from pathlib import Path
from fuzz import strict_indices
strict_indices.FOLDER = Path(sys.argv[1])
strict_indices.refuse_bad_indices()
import numba, numpy as np
@numba.njit
def last(x, i):
    return x[-1] + x[1:-1].sum() + x[i]
x = np.arange(4.0)
found = [last(x, 3)]
for i in (4, -1):
    try:
        found.append(last(x, i))
    except IndexError:
        found.append("refused")
print(found)
"""


def test_kernels_refuse_bad_indices(tmp_path: Path) -> None:
    """Beyond the end, and below 0 unless a constant says so."""
    done = subprocess.run([sys.executable, "-c", INDICES, str(tmp_path)], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[9.0, 'refused', 'refused']"


@pytest.mark.skipif(shutil.which("node") is None or sys.platform == "win32", reason="no Node")
def test_the_web_players_readers(tmp_path: Path) -> None:
    node = Node()
    node.read(STILL)
    parts = split_video(STILL.read_bytes())
    case = write_files(join_video({**parts, "order": parts["order"][:-5]}), tmp_path / "case")
    with pytest.raises(RefusedByPlayer, match=rf"{FILE}.*'order'"):
        node.read(case)
    node.close()


@pytest.mark.parametrize("number", range(3), ids=["names", "http", "kernels"])
def test_names_answers_and_files_of_kernels(number: int, tmp_path: Path) -> None:
    """Sound ones are taken, mutated ones are taken or refused."""
    target = strange_targets((GOLDEN / "pdct-1.mp4").read_bytes())[number]
    judge(target, write_files(target.join(target.seeds[0].parts), tmp_path / "case"), 10**5)  # what loads costs once
    verdicts = [
        judge(target, write_files(target.join(target.case(1, k)[1]), tmp_path / "case"), 10**5)
        for k in range(len(target.seeds) + 40)
    ]
    assert {verdict.kind for verdict in verdicts} <= {ACCEPTED, REFUSED}, verdicts
    assert verdicts[0].kind == ACCEPTED, verdicts[0]
