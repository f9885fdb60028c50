"""Batches of arrays, tensors of PyTorch, and the decoder for `webdataset`."""

from __future__ import annotations

import pickle
import subprocess
import sys
import tarfile
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from sequences import waving

import gvpipe
from gvpipe import datasets
from gvpipe.foundation.errors import InputError, MissingSection
from gvpipe.model.sequence import MeshSequence

SIDES = (25, 25, 25, 25, 5)


@pytest.fixture(scope="module")
def shard(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four sequences that share sections, and a small one, which is longer."""
    folder = tmp_path_factory.mktemp("sequences")
    for k, side in enumerate(SIDES):
        sheet = waving(side, 4 if side == SIDES[0] else 6)
        sequence = MeshSequence(sheet.positions[:] * np.float32(1 + k), sheet.faces, sheet.fps)
        gvpipe.encode(sequence, folder / f"s{k}.mp4", "pca", bare=True)
    assert datasets.pack(folder, folder / "a.tar").shared_sections
    return folder / "a.tar"


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch) -> None:
    """What `torch` is to this package: tensors from arrays."""
    module = types.ModuleType("torch")
    cast("Any", module).from_numpy = lambda array: ("tensor", array)
    monkeypatch.setitem(sys.modules, "torch", module)


def test_filled_batches(shard: Path) -> None:
    dataset = datasets.open(shard)
    batch = datasets.collate([dataset[k] for k in (0, 4)])
    assert batch["positions"].shape == (2, 6, 625, 3) and batch["positions"].dtype == np.float32
    assert batch["key"] == ["s0", "s4"] and batch["fps"].tolist() == [dataset[0]["fps"], dataset[4]["fps"]]
    assert batch["frame_mask"].sum(1).tolist() == [4, 6] and batch["vertex_mask"].sum(1).tolist() == [625, 25]
    for k, number in enumerate((0, 4)):
        sample = dataset[number]
        held = batch["positions"][k][batch["frame_mask"][k]][:, batch["vertex_mask"][k]]
        np.testing.assert_array_equal(held, sample["positions"])
        np.testing.assert_array_equal(batch["faces"][k][batch["face_mask"][k]], sample["faces"])
    lost = batch["positions"] * ~(batch["frame_mask"][:, :, None, None] & batch["vertex_mask"][:, None, :, None])
    assert not lost.any()


def test_packed_batches(shard: Path) -> None:
    dataset = datasets.open(shard)
    samples = list(dataset.samples(slice(0, 3), transform=lambda sample: {**sample, "label": sample["key"].upper()}))
    batch = datasets.collate(samples, packed=True)
    assert batch["label"] == ["S0", "S1", "S2", "S3", "S4"]
    for k, sample in enumerate(samples):
        own = slice(*batch["vertex_offsets"][k : k + 2])
        np.testing.assert_array_equal(batch["positions"][:, own], sample["positions"])
        faces = batch["faces"][slice(*batch["face_offsets"][k : k + 2])] - batch["vertex_offsets"][k]
        np.testing.assert_array_equal(faces, sample["faces"])
        assert set(batch["batch"][own]) == {k}
    with pytest.raises(InputError, match=r"samples of 4 and of 6 frames cannot be packed; .*slice\(0, 4\)"):
        datasets.collate(list(dataset), packed=True)
    with pytest.raises(InputError, match="give at least one"):
        datasets.collate([])
    with pytest.raises(InputError, match="a sample has no positions and no faces"):
        datasets.collate([{"key": "a", "fps": 1}])


@pytest.mark.usefixtures("stand_in")
def test_tensors_by_a_stand_in(shard: Path) -> None:
    dataset = datasets.open(shard)
    found = datasets.torch(dataset, slice(0, 2), lod=1)
    assert len(found) == 5 and len(list(found)) == 5
    kind, positions = found["s1"]["positions"]
    assert kind == "tensor" and found[1]["key"] == "s1"
    np.testing.assert_array_equal(positions, dataset.read("s1", slice(0, 2), lod=1))
    batch = datasets.collate_tensors(list(dataset))
    assert batch["vertex_mask"][0] == "tensor" and batch["key"] == dataset.keys
    assert len(datasets.torch(shard, transform=lambda sample: sample["key"])) == 5


def test_without_torch(shard: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(InputError, match="PyTorch is not installed; pip install torch"):
        datasets.torch(shard)


def test_neither_is_imported_before() -> None:
    code = "import sys, gvpipe.datasets; assert not {'torch', 'webdataset'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_torch_loads_batches(shard: Path, method: str) -> None:
    data = pytest.importorskip("torch.utils.data")
    found: Any = datasets.torch(shard, slice(0, 4))
    loader = data.DataLoader(
        found, batch_size=5, num_workers=2, multiprocessing_context=method, collate_fn=datasets.collate_tensors
    )
    (batch,) = list(loader)
    assert batch["positions"].shape == (5, 4, 625, 3) and batch["vertex_mask"][4].sum() == 25


def test_decoder_alone(shard: Path) -> None:
    dataset = datasets.open(shard)
    decode = pickle.loads(pickle.dumps(datasets.webdataset_decoder(shard, slice(1, 3))))
    with tarfile.open(shard) as archive:
        file = archive.extractfile("s2.mp4")
        assert file is not None
        data = file.read()
    found = decode(".mp4", data)
    np.testing.assert_array_equal(found["positions"], dataset.read("s2", slice(1, 3)))
    np.testing.assert_array_equal(found["faces"], dataset.faces("s2"))
    assert decode(".json", b"{}") is None and found["fps"] == dataset["s2"]["fps"]
    with pytest.raises(MissingSection, match="gvpipe unpack"):
        datasets.webdataset_decoder()(".mp4", data)
    with pytest.raises(TypeError, match="a slice is needed"):
        datasets.webdataset_decoder(shard, cast("Any", 3))


def _batches(loaded: Any) -> Iterator[dict[str, Any]]:
    for sample in loaded:
        yield {"key": sample["__key__"], **sample["mp4"]}


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.filterwarnings("ignore::ResourceWarning")  # it leaves files to the garbage collector
def test_decoder_of_webdataset(shard: Path) -> None:
    webdataset = pytest.importorskip("webdataset")
    dataset = datasets.open(shard)
    loaded = webdataset.WebDataset(str(shard), shardshuffle=False).shuffle(5).decode(datasets.webdataset_decoder(shard))
    samples = list(_batches(loaded))
    assert sorted(sample["key"] for sample in samples) == dataset.keys
    for sample in samples:
        np.testing.assert_array_equal(sample["positions"], dataset.read(sample["key"]))
    assert datasets.collate(samples)["positions"].shape == (5, 6, 625, 3)
