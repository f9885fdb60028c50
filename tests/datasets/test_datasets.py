"""Shards: packed in WebDataset's layout, read at random, damaged, hostile, from threads and other processes."""

from __future__ import annotations

import io
import json
import multiprocessing
import pickle
import tarfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from sequences import waving

import gvpipe
from gvpipe import datasets
from gvpipe.foundation.errors import CorruptFile, FormatError, InputError, OutputError, TruncatedFile
from gvpipe.model.sequence import MeshSequence

NAMES = ("cats/walk.v2", "s2", "s10")
WAVING = waving(9, 6)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three sequences of one connectivity, one with a description, one damaged."""
    folder = tmp_path_factory.mktemp("sequences")
    (folder / "cats").mkdir()
    for k, name in enumerate(NAMES):
        sequence = MeshSequence(WAVING.positions[:] * np.float32(1 + k), WAVING.faces, WAVING.fps)
        gvpipe.encode(sequence, folder / f"{name}.mp4", "pca", bare=True)
    (folder / "s2.json").write_text('{"label": "waves", "max_diag": 0.001, "vertices": 5}')
    (folder / "damaged.mp4").write_bytes((folder / "s2.mp4").read_bytes()[:-1])
    return folder


@pytest.fixture(scope="module")
def shards(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in two shards."""
    target = tmp_path_factory.mktemp("shards")
    packed = datasets.pack(folder, target / "set-%03d.tar", shard_sequences=2)
    assert [Path(path).name for path in packed.shards] == ["set-000.tar", "set-001.tar"] and packed.sequences == 3
    assert list(packed.left_out) == [str(folder / "damaged.mp4")]
    return target


def test_layout_is_that_of_webdataset(folder: Path, shards: Path) -> None:
    with tarfile.open(shards / "set-000.tar") as archive:
        members = archive.getmembers()
        assert [member.name for member in members] == ["cats/walk_v2.mp4", "cats/walk_v2.json", "s2.mp4", "s2.json"]
        assert all(member.mtime == member.uid == member.gid == 0 and not member.uname for member in members)
        video, description = archive.extractfile(members[2]), archive.extractfile(members[3])
        assert video is not None and description is not None
        assert video.read() == (folder / "s2.mp4").read_bytes()
        found = json.loads(description.read())
    assert found["label"] == "waves" and found["vertices"] == 81 and found["frames"] == 6 and found["codec"] == "pca"


def test_equal_folders_make_equal_shards(folder: Path, shards: Path, tmp_path: Path) -> None:
    datasets.pack(folder, tmp_path / "a-%d.tar", shard_sequences=2)
    assert (tmp_path / "a-1.tar").read_bytes() == (shards / "set-001.tar").read_bytes()
    datasets.pack(folder, tmp_path / "b-%d.tar", shard_bytes=(tmp_path / "a-0.tar").stat().st_size // 2)
    assert [len(datasets.open(path)) for path in sorted(tmp_path.glob("b-*.tar"))] == [1, 1, 1]


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.filterwarnings("ignore::ResourceWarning")  # it leaves files to the garbage collector
def test_webdataset_reads_them(shards: Path) -> None:
    webdataset = pytest.importorskip("webdataset")
    paths = [str(path) for path in sorted(shards.glob("*.tar"))]
    samples = list(webdataset.WebDataset(paths, shardshuffle=False))
    assert [sample["__key__"] for sample in samples] == ["cats/walk_v2", "s2", "s10"]
    assert gvpipe.Player("sample", data=samples[1]["mp4"]).shape == (6, 81, 3)


def test_random_access(folder: Path, shards: Path) -> None:
    dataset = datasets.open(shards / "set-*.tar")
    assert len(dataset) == 3 and dataset.keys == ["cats/walk_v2", "s2", "s10"]
    for key, name in zip(dataset.keys, NAMES, strict=True):
        with gvpipe.open(folder / f"{name}.mp4") as video:
            np.testing.assert_array_equal(dataset.read(key), video[:])
            np.testing.assert_array_equal(dataset[key]["faces"], video.faces)
            np.testing.assert_array_equal(dataset.read(key, slice(4, 1, -2)), video[1:5][[3, 1]])
            level = video.level(1)
            np.testing.assert_array_equal(dataset.read(key, slice(1, 3), lod=1), level.read(1, 3))
            np.testing.assert_array_equal(dataset.faces(key, lod=9), level.faces)
    assert dataset.read(-1).shape == (6, 81, 3) and dataset.read(0, slice(0, 0)).shape == (0, 81, 3)
    assert dataset.description("s2")["label"] == "waves"
    with pytest.raises(IndexError, match="there are 3"):
        dataset.read(3)
    with pytest.raises(KeyError, match="no sample 'none'"):
        dataset.read("none")


def test_samples_and_batches(shards: Path) -> None:
    dataset = datasets.open([shards / "set-001.tar", shards / "set-000.tar"])
    sizes = [len(batch) for batch in dataset.batches(2, slice(0, 2), lod=1)]
    assert sizes == [2, 1]
    shuffled = [[sample["key"] for sample in batch] for batch in dataset.batches(3, seed=7)]
    assert sorted(shuffled[0]) == sorted(dataset.keys)
    assert shuffled == [[sample["key"] for sample in batch] for batch in dataset.batches(3, seed=7)]
    counts = dataset.samples(slice(0, 2), transform=lambda sample: sample["positions"].shape)
    assert list(counts) == [(2, 81, 3)] * 3
    sample = dataset[0]
    sample["faces"][:] = 0  # what it gives is the caller's own
    assert dataset[0]["faces"].any()


def _sum(dataset: datasets.Dataset, number: int) -> float:
    return float(dataset.read(number).sum())


def test_threads_and_copies(shards: Path) -> None:
    dataset = datasets.open(shards / "set-*.tar")
    wanted = [_sum(dataset, k) for k in range(3)]
    with ThreadPoolExecutor(3) as threads:
        assert list(threads.map(_sum, [dataset] * 9, [0, 1, 2] * 3)) == wanted * 3
    copy = pickle.loads(pickle.dumps(dataset))
    assert [_sum(copy, k) for k in range(3)] == wanted


@pytest.mark.filterwarnings("ignore:This process.*is multi-threaded:DeprecationWarning")
@pytest.mark.parametrize("method", ["fork", pytest.param("spawn", marks=pytest.mark.slow)])
def test_other_processes(shards: Path, method: str) -> None:
    if method not in multiprocessing.get_all_start_methods():
        pytest.skip(f"no {method} here")
    dataset = datasets.open(shards / "set-*.tar")
    wanted = [_sum(dataset, k) for k in range(3)]
    with multiprocessing.get_context(method).Pool(1) as pool:
        assert pool.starmap_async(_sum, [(dataset, k) for k in range(3)]).get(60) == wanted


@pytest.mark.slow
@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_torch_loads_it(shards: Path, method: str) -> None:
    data = pytest.importorskip("torch.utils.data")
    dataset = datasets.open(shards / "set-*.tar")
    loader: Any = data.DataLoader(dataset.samples(slice(0, 4)), batch_size=3, num_workers=2, multiprocessing_context=method)
    (batch,) = list(loader)
    assert batch["positions"].shape == (3, 4, 81, 3) and batch["key"] == dataset.keys
    np.testing.assert_array_equal(batch["positions"][1].numpy(), dataset.read(1, slice(0, 4)))


def test_cut_shards_name_sample_and_byte(shards: Path, tmp_path: Path) -> None:
    data, path = (shards / "set-000.tar").read_bytes(), tmp_path / "cut.tar"
    with tarfile.open(shards / "set-000.tar") as archive:
        starts = {member.name: member.offset_data for member in archive}
        ends = {member.name: member.offset_data + member.size for member in archive}
    for size, message in (
        (0, "ends at byte 0, before its first sample"),
        (
            starts["s2.mp4"] + 9,
            rf"ends at byte {starts['s2.mp4'] + 9}, inside sample 's2', which goes on to byte {ends['s2.mp4']}",
        ),
        (starts["s2.mp4"] - 512, r"behind sample 'cats/walk_v2', without the mark of its end"),
        (starts["s2.mp4"] - 100, "damaged|without the mark"),
    ):
        path.write_bytes(data[:size])
        with pytest.raises(FormatError, match=message) as caught:
            datasets.open(path)
        assert str(path) in str(caught.value) and "\n" not in str(caught.value)
    path.write_bytes(data[: starts["s2.mp4"] - 512] + b"?" * 512 + data[starts["s2.mp4"] :])
    with pytest.raises(
        CorruptFile, match=rf"header at byte {starts['s2.mp4'] - 512}, behind sample 'cats/walk_v2', is damaged"
    ):
        datasets.open(path)
    changed = bytearray(data)
    changed[starts["s2.mp4"] + 200] ^= 1
    path.write_bytes(changed)
    dataset = datasets.open(path)
    with pytest.raises(CorruptFile, match=rf"cut\.tar, sample 's2' at byte {starts['s2.mp4']}: "):
        dataset.read("s2")
    assert dataset.read(0).shape == (6, 81, 3)
    path.write_bytes(data[:700])
    with pytest.raises(FormatError, match="changed since it was opened"):
        dataset.read(0)


def _write(path: Path, *members: tuple[str, bytes, Callable[[tarfile.TarInfo], None]]) -> Path:
    with tarfile.open(path, "w") as archive:
        for name, data, change in members:
            member = tarfile.TarInfo(name)
            member.size = len(data)
            change(member)
            archive.addfile(member, io.BytesIO(data))
    return path


def _keep(member: tarfile.TarInfo) -> None:
    pass


def _link(member: tarfile.TarInfo) -> None:
    member.type, member.linkname, member.size = tarfile.SYMTYPE, "/etc/passwd", 0


@pytest.mark.parametrize("name", ["/etc/passwd.mp4", "../a.mp4", "a/../../b.mp4", "a\\b.mp4", "a\nb.mp4"])
def test_names_that_lead_out_are_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(CorruptFile, match="the member at byte 0 has the name"):
        datasets.open(_write(tmp_path / "a.tar", (name, b"", _keep)))


def test_hostile_members(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a\.tar: no sample is in it"):
        datasets.open(_write(tmp_path / "a.tar", ("a.mp4", b"", _link), ("b.txt", b"x", _keep)))
    with pytest.raises(CorruptFile, match="'a.mp4' at byte .* occurs twice"):
        datasets.open(_write(tmp_path / "b.tar", ("a.mp4", b"x", _keep), ("a.mp4", b"y", _keep)))
    huge = bytearray(_write(tmp_path / "c.tar", ("a.mp4", b"", _keep)).read_bytes())
    member = tarfile.TarInfo("a.mp4")
    member.size = 1 << 62
    huge[:512] = member.tobuf(tarfile.GNU_FORMAT)
    (tmp_path / "c.tar").write_bytes(huge)
    with pytest.raises(TruncatedFile, match="inside sample 'a', which goes on to byte"):
        datasets.open(tmp_path / "c.tar")
    (tmp_path / "d.tar").write_bytes(b"no tar" * 200)
    with pytest.raises(CorruptFile, match="no tar file"):
        datasets.open(tmp_path / "d.tar")
    chain = member.__class__("././@LongLink")
    chain.type, chain.size = tarfile.GNUTYPE_LONGNAME, 0
    (tmp_path / "e.tar").write_bytes(chain.tobuf(tarfile.GNU_FORMAT) * 5000)
    with pytest.raises(FormatError):
        datasets.open(tmp_path / "e.tar")
    text = _write(tmp_path / "f.tar", ("a.mp4", b"x", _keep), ("a.json", b"[" * 9, _keep))
    with pytest.raises(CorruptFile, match="sample 'a' .* not JSON"):
        datasets.open(text).description(0)


def test_one_key_in_two_shards_is_refused(shards: Path, tmp_path: Path) -> None:
    (tmp_path / "set.tar").write_bytes((shards / "set-001.tar").read_bytes())
    with pytest.raises(InputError, match="sample 's10' is in"):
        datasets.open([shards / "set-001.tar", tmp_path / "set.tar"])
    with pytest.raises(InputError, match="no such shard"):
        datasets.open(tmp_path / "none-*.tar")
    with pytest.raises(InputError, match=r"is a folder; give its shards, such as .*\*\.tar"):
        datasets.open(tmp_path)


def test_keys_are_in_it(shards: Path) -> None:
    data = datasets.open(shards / "set-001.tar")
    assert "s10" in data and "none" not in data and 0 not in data


def test_pack_refuses(folder: Path, shards: Path, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"set-000\.tar is there already; remove"):
        datasets.pack(folder, shards / "set-%03d.tar")
    for pattern in ("a.zip", "a-%d-%d.tar", "a-%s.tar"):
        with pytest.raises(InputError, match="one number at most"):
            datasets.pack(folder, tmp_path / pattern)
    with pytest.raises(InputError, match=r"no \.mp4 files"):
        datasets.pack(tmp_path, tmp_path / "a.tar")
    with pytest.raises(InputError, match="shard_bytes is 0"):
        datasets.pack(folder, tmp_path / "a.tar", shard_bytes=0)
    for name in ("a.b.mp4", "a_b.mp4"):
        (tmp_path / name).write_bytes((folder / "s2.mp4").read_bytes())
    with pytest.raises(InputError, match="both have the key 'a_b'"):
        datasets.pack(tmp_path, tmp_path / "a.tar")


def test_summary(shards: Path) -> None:
    found = datasets.summarise(shards / "set-*.tar")
    assert (found.shards, found.sequences, found.codecs) == (2, 3, {"pca": 3})
    assert found.vertices == {"least": 81, "most": 81, "all": 243} and found.frames["all"] == 18
    assert found.worst == {"max_diag": {"value": 0.001, "sample": "s2"}}
    assert found.bytes == sum(path.stat().st_size for path in shards.glob("*.tar"))
    assert found.ratio == pytest.approx(12 * 81 * 18 / found.video_bytes)


def test_wrong_types_are_named(shards: Path) -> None:
    data = datasets.open(shards / "set-001.tar")
    wrong: Any = 3
    for call, message in (
        (lambda: data.read(0, frames=wrong), r"frames are .*; a slice is needed"),
        (lambda: data.read(0, lod=cast("Any", "2")), r"lod is .*; an integer is needed"),
        (lambda: data.samples(lod=cast("Any", 1.5)), r"lod is .*; an integer is needed"),
        (lambda: data.samples(transform=wrong), r"transform is .*; a function"),
        (lambda: data.batches(cast("Any", "2")), r"the size of batches is .*; an integer"),
    ):
        with pytest.raises(TypeError, match=message):
            call()
    with pytest.raises(InputError, match="no level of detail -1"):
        data.samples(lod=-1)
