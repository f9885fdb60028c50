"""Shards that store once what several files have in common: as small as they should be, whole again, and hostile."""

from __future__ import annotations

import io
import multiprocessing
import pickle
import tarfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from folders import GOLDEN
from sequences import waving

import gvpipe
from gvpipe import datasets
from gvpipe.cli.commands import cli
from gvpipe.container.mp4 import file_bytes, read_bytes
from gvpipe.container.shared_sections import section_hash
from gvpipe.datasets.sample_names import shared_name
from gvpipe.foundation.errors import CorruptFile, FormatError, MissingSection, OutputError
from gvpipe.model.sequence import MeshSequence

SIDES = (25, 27)  # vertices of a side, of two connectivities
N_EACH = 5


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five sequences each of two connectivities, one after the other, and one in the plain layout."""
    folder = tmp_path_factory.mktemp("sequences")
    for k in range(len(SIDES) * N_EACH):
        sheet = waving(SIDES[k % 2], 4)
        sequence = MeshSequence(sheet.positions[:] * np.float32(1 + k), sheet.faces, sheet.fps)
        gvpipe.encode(sequence, folder / f"s{k}.mp4", "pca", bare=True)
    gvpipe.encode(waving(SIDES[0], 4), folder / "plain.mp4", "pca")
    return folder


@pytest.fixture(scope="module")
def shard(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in one shard."""
    path = tmp_path_factory.mktemp("shards") / "a.tar"
    assert datasets.pack(folder, path).shared_sections >= 2
    return path


def _members(path: Path) -> dict[str, bytes]:
    with tarfile.open(path) as archive:
        found = {}
        for member in archive:
            file = archive.extractfile(member)
            assert file is not None
            found[member.name] = file.read()
        return found


def _write(path: Path, members: dict[str, bytes]) -> Path:
    with tarfile.open(path, "w", format=tarfile.USTAR_FORMAT) as archive:
        for name, data in members.items():
            member = tarfile.TarInfo(name)
            member.size = len(data)
            archive.addfile(member, io.BytesIO(data))
    return path


def _shared(members: dict[str, bytes]) -> Iterator[str]:
    return (name for name in members if name.startswith("__shared-"))


def test_it_is_smaller_and_reads_the_same(folder: Path, shard: Path, tmp_path: Path) -> None:
    whole = datasets.pack(folder, tmp_path / "whole.tar", share=False)
    assert not list(_shared(_members(tmp_path / "whole.tar"))) and whole.shared_sections == 0
    few, many = (sum(map(len, _members(path).values())) for path in (shard, tmp_path / "whole.tar"))  # without padding
    assert few < 0.8 * many and shard.stat().st_size <= whole.bytes
    found, wanted = datasets.open(shard), datasets.open(tmp_path / "whole.tar")
    assert found.keys == wanted.keys and len(found) == 11
    for key in found.keys:
        np.testing.assert_array_equal(found.read(key), wanted.read(key))
        np.testing.assert_array_equal(found.faces(key, lod=1), wanted.faces(key, lod=1))
        np.testing.assert_array_equal(found.open(key)[1:3], wanted.open(key)[1:3])
        assert found.whole_file(key) == wanted.whole_file(key) == (folder / f"{key}.mp4").read_bytes()
        assert found.description(key) == wanted.description(key)
    sums = [datasets.summarise(path) for path in (shard, tmp_path / "whole.tar")]
    assert sums[0].video_bytes < sums[1].video_bytes and sums[0].ratio > sums[1].ratio


def test_layout(shard: Path) -> None:
    members = _members(shard)
    for name in _shared(members):
        assert name == shared_name(section_hash(members[name]))
    first = list(members).index("s0.mp4")
    assert all(list(members).index(name) < first + 4 for name in _shared(members))  # before the first that needs it
    assert members["plain.mp4"].count(b"gvbare") == 0  # as it was


def test_golden_shard(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    path, expected = GOLDEN / "layouts" / "shared.tar", GOLDEN / "layouts" / "shared.npz"
    if request.config.getoption("--write-golden"):
        sheet = waving(SIDES[0], 2)
        for k in range(4):
            sequence = MeshSequence(sheet.positions[:] * np.float32(1 + k), sheet.faces, sheet.fps)
            gvpipe.encode(sequence, tmp_path / f"s{k}.mp4", "pca", quality=20, bare=True)
        path.unlink(missing_ok=True)
        assert datasets.pack(tmp_path, path).shared_sections
        np.savez(expected, **{sample["key"]: sample["positions"] for sample in datasets.open(path)})
    wanted = np.load(expected)
    for sample in datasets.open(path):
        np.testing.assert_array_equal(sample["positions"], wanted[sample["key"]])


def test_equal_folders_make_equal_shards(folder: Path, shard: Path, tmp_path: Path) -> None:
    datasets.pack(folder, tmp_path / "b.tar")
    assert (tmp_path / "b.tar").read_bytes() == shard.read_bytes()


def test_each_shard_stands_alone(folder: Path, tmp_path: Path) -> None:
    packed = datasets.pack(folder, tmp_path / "a-%d.tar", shard_sequences=6)
    assert len(packed.shards) == 2
    for path in packed.shards:
        for sample in datasets.open(path):
            assert sample["positions"].shape[0] == 4
    limit = 40_000
    packed = datasets.pack(folder, tmp_path / "b-%d.tar", shard_bytes=limit)
    sizes = [sum(512 + len(data) + -len(data) % 512 for data in _members(Path(path)).values()) for path in packed.shards]
    assert len(sizes) > 1 and max(sizes) + 1024 <= limit


def test_unlike_files_stay_as_they_are(folder: Path, tmp_path: Path) -> None:
    few = tmp_path / "few"
    few.mkdir()
    for k in range(2):  # one of each connectivity
        (few / f"{k}.mp4").write_bytes((folder / f"s{k}.mp4").read_bytes())
    assert datasets.pack(few, tmp_path / "few.tar").shared_sections == 0
    assert _members(tmp_path / "few.tar")["0.mp4"] == (folder / "s0.mp4").read_bytes()


@pytest.mark.slow
def test_pictures_come_back(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    sheet = waving(25, 4)
    for k in range(6):
        sequence = MeshSequence(sheet.positions[:] + np.float32(k), sheet.faces, sheet.fps)
        gvpipe.encode(sequence, tmp_path / "in" / f"{k}.mp4", "mcgv", image="jpeg", clusters=2, bare=True)
    datasets.pack(tmp_path / "in", tmp_path / "a.tar")
    dataset = datasets.open(tmp_path / "a.tar")
    for key in dataset.keys:
        assert dataset.whole_file(key) == (tmp_path / "in" / f"{key}.mp4").read_bytes()


def test_a_sample_alone_names_what_is_missing(shard: Path, tmp_path: Path) -> None:
    path = tmp_path / "s3.mp4"
    path.write_bytes(_members(shard)["s3.mp4"])
    for read in (gvpipe.open, gvpipe.info, gvpipe.decode):
        call: Callable[[Path], Any] = read
        with pytest.raises(MissingSection, match=r"s3\.mp4: section '\w+' is shared section [0-9a-f]{32} .*gvpipe unpack"):
            call(path)
    shared = datasets.shared_sections(shard)
    wanted = datasets.open(shard).read("s3")
    with gvpipe.open(path, shared=shared) as video:
        np.testing.assert_array_equal(video[:], wanted)
        np.testing.assert_array_equal(pickle.loads(pickle.dumps(video))[:], wanted)
    np.testing.assert_array_equal(gvpipe.Player("s3", data=path.read_bytes(), shared=shared)[:], wanted)
    datasets.pack(tmp_path, tmp_path / "b.tar").left_out[str(path)].index("shared section")


def test_unpack(folder: Path, shard: Path, tmp_path: Path) -> None:
    done = datasets.unpack(shard, tmp_path / "all")
    assert done.sequences == 11 and done.bytes == sum(path.stat().st_size for path in folder.glob("*.mp4"))
    for path in folder.glob("*.mp4"):
        assert (tmp_path / "all" / path.name).read_bytes() == path.read_bytes()
        assert (tmp_path / "all" / f"{path.stem}.json").exists()
    with pytest.raises(OutputError, match="is there already"):
        datasets.unpack(shard, tmp_path / "all", ["s1"])
    run = CliRunner().invoke(cli, ["unpack", str(shard), str(tmp_path / "some"), "s1", "s2"])
    assert run.exit_code == 0 and "2 sequences" in run.stdout
    assert sorted(path.name for path in (tmp_path / "some").iterdir()) == ["s1.json", "s1.mp4", "s2.json", "s2.mp4"]
    run = CliRunner().invoke(cli, ["unpack", str(shard), str(tmp_path / "x"), "none"])
    assert "no sample 'none'" in str(run.exception)


def test_pack_by_command(folder: Path, tmp_path: Path) -> None:
    run = CliRunner().invoke(cli, ["pack", str(folder), str(tmp_path / "a.tar")])
    assert run.exit_code == 0 and "shared section" in run.stdout
    run = CliRunner().invoke(cli, ["pack", "--no-share", str(folder), str(tmp_path / "b.tar")])
    assert run.exit_code == 0 and "shared section" not in run.stdout


def test_hostile_shards(shard: Path, tmp_path: Path) -> None:
    members = _members(shard)
    names = list(_shared(members))
    missing = {name: data for name, data in members.items() if name not in names}
    with pytest.raises(MissingSection, match=r"a\.tar, sample 's0' .* which its shard does not have; get the shard again"):
        datasets.open(_write(tmp_path / "a.tar", missing)).read("s0")
    wrong = {name: data[:-1] + b"?" if name in names else data for name, data in members.items()}
    longer = {name: data + b"?" if name in names else data for name, data in members.items()}
    # a shared section that is itself a file with references is the bytes of a section: its hash does not hold
    loop = {name: members["s0.mp4"] if name in names else data for name, data in members.items()}
    for number, changed in enumerate((wrong, longer, loop)):
        dataset = datasets.open(_write(tmp_path / f"b{number}.tar", changed))
        with pytest.raises(CorruptFile, match=r"sample 's0' .*section .* is not the one that the file was packed with"):
            dataset.read("s0")
        assert dataset.read("plain").shape[0] == 4
    doubled = tmp_path / "c.tar"
    with tarfile.open(doubled, "w") as archive:
        for _ in range(2):
            archive.addfile(tarfile.TarInfo(names[0]))
    with pytest.raises(CorruptFile, match="occurs twice"):
        datasets.open(doubled)


def test_huge_shared_sections_are_refused(folder: Path, shard: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gvpipe.datasets.shared.MAX_SHARED", 300)
    with pytest.raises(CorruptFile, match=r"sample 's0' .*member __shared-.* bytes, above 300"):
        datasets.open(shard).read("s0")
    monkeypatch.setattr("gvpipe.container.shared_sections.MAX_SHARED", 300)
    with pytest.raises(CorruptFile, match=r"its shared sections have \d+ bytes, above 300"):
        datasets.open(shard).read("s0")


def test_hostile_references(folder: Path) -> None:
    data = (folder / "s0.mp4").read_bytes()
    bitstream = read_bytes(data, "a")
    mesh = bitstream.sections["mesh"]
    for shared, message in (
        ({"none": section_hash(mesh)}, "of no section, or no hash"),
        ({"mesh": "../../etc/passwd"}, "of no section, or no hash"),
        ({"mesh": section_hash(mesh).upper()}, "of no section, or no hash"),
    ):
        with pytest.raises(CorruptFile, match=message):
            read_bytes(file_bytes(bitstream, shared=shared), "a", find=lambda _: mesh)
    good = file_bytes(bitstream, shared={"mesh": section_hash(mesh)})
    found = read_bytes(good, "a", find=lambda _: mesh)
    assert found.sections == bitstream.sections and found.n_bytes == found.budget.n_bytes == len(good) + len(mesh)
    for size in (*range(0, len(good), 97), len(good) - 1):
        with pytest.raises(FormatError):
            read_bytes(good[:size], "a", find=lambda _: mesh)
    for place in range(32, len(good), 41):
        changed = bytearray(good)
        changed[place] ^= 0x21
        with pytest.raises(FormatError):
            read_bytes(bytes(changed), "a", find=lambda _: mesh)


def _sum(dataset: datasets.Dataset, number: int) -> float:
    return float(dataset.read(number).sum())


@pytest.mark.filterwarnings("ignore:This process.*is multi-threaded:DeprecationWarning")
@pytest.mark.parametrize("method", ["fork", pytest.param("spawn", marks=pytest.mark.slow)])
def test_other_processes(shard: Path, method: str) -> None:
    if method not in multiprocessing.get_all_start_methods():
        pytest.skip(f"no {method} here")
    dataset = datasets.open(shard)
    wanted = [_sum(dataset, k) for k in range(4)]
    with multiprocessing.get_context(method).Pool(1) as pool:
        assert pool.starmap_async(_sum, [(dataset, k) for k in range(4)]).get(60) == wanted


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.filterwarnings("ignore::ResourceWarning")  # it leaves files to the garbage collector
def test_webdataset_passes_over_shared_sections(shard: Path) -> None:
    webdataset = pytest.importorskip("webdataset")
    samples = list(webdataset.WebDataset(str(shard), shardshuffle=False).to_tuple("__key__", "mp4", "json"))
    assert [key for key, _, _ in samples] == datasets.open(shard).keys
