"""What samples say of their positions and errors, and cards of data sets."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from sequences import waving

import gvpipe
from gvpipe import datasets
from gvpipe.cli.commands import cli
from gvpipe.datasets.card import BEGIN, FINISH
from gvpipe.datasets.statistics import measure, name_topology
from gvpipe.foundation.errors import InputError


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three sequences by ``encode-all``, of two topologies, and one that was encoded alone."""
    inputs, folder = tmp_path_factory.mktemp("in"), tmp_path_factory.mktemp("out")
    for k, side in enumerate((5, 5, 6)):
        gvpipe.write(waving(side, 4), inputs / f"s{k}.npz")
    gvpipe.encode_all(inputs, folder, "pca", max_error="0.1%", bare=True, workers=1)
    gvpipe.encode(waving(6, 3), folder / "t.mp4", "pca", bare=True)
    return folder


def _descriptions(path: Path) -> dict[str, dict[str, Any]]:
    dataset = datasets.open(path)
    return {key: dataset.description(key) for key in dataset.keys}


def test_samples_describe_their_positions(folder: Path, tmp_path: Path) -> None:
    datasets.pack(folder, tmp_path / "a.tar")
    found = _descriptions(tmp_path / "a.tar")
    for key, description in found.items():
        positions = datasets.open(tmp_path / "a.tar").read(key).reshape(-1, 3).astype(float)
        np.testing.assert_allclose(description["box"], [positions.min(0), positions.max(0)], rtol=1e-5, atol=1e-9)
        np.testing.assert_allclose(description["mean"], positions.mean(0), rtol=1e-5, atol=1e-9)
        scale = np.sqrt(((positions - positions.mean(0)) ** 2).sum(1).mean())
        np.testing.assert_allclose(description["scale"], scale, rtol=1e-5)
    assert found["s0"]["topology"] == found["s1"]["topology"] != found["s2"]["topology"] == found["t"]["topology"]
    assert 0 < found["s0"]["max_diag"] <= 0.001 and found["s0"]["kg"] > 0 and found["s0"]["rmse"] < found["s0"]["max"]
    assert "max_diag" not in found["t"]  # no target, nothing measured
    lines = [json.loads(line) for line in (folder / "manifest.jsonl").read_text().splitlines()]
    assert {line["output"]: line["description"] for line in lines} == {f"s{k}.mp4": found[f"s{k}"] for k in range(3)}


def test_a_manifest_of_changed_files_is_not_used(folder: Path, tmp_path: Path) -> None:
    for path in folder.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "s0.mp4").write_bytes((folder / "s2.mp4").read_bytes())
    text = (tmp_path / "manifest.jsonl").read_text()
    (tmp_path / "manifest.jsonl").write_text("no line\n[1]\n" + text)
    (tmp_path / "s1.json").write_text('{"kg": 9, "label": 1, "box": "mine"}')
    datasets.pack(tmp_path, tmp_path / "a.tar")
    found, wanted = _descriptions(tmp_path / "a.tar"), json.loads(text.splitlines()[1])["description"]
    assert found["s0"]["topology"] == found["s2"]["topology"] and "max_diag" not in found["s0"]
    assert found["s1"] == {**wanted, "label": 1}


def test_errors_of_an_encode_are_those_of_its_file(tmp_path: Path) -> None:
    sequence = waving(6, 5)
    report = gvpipe.encode(sequence, tmp_path / "a.mp4", "pca", target_kg=0.1)
    found = gvpipe.compare(sequence, gvpipe.read(tmp_path / "a.mp4")).to_json()
    assert set(report.errors) == {"rmse", "rmse_diag", "max", "max_diag", "kg"}
    for name, value in report.errors.items():
        assert value == pytest.approx(found[name], rel=1e-3)
    assert gvpipe.encode(sequence, tmp_path / "b.mp4", "pca").errors == {}


def test_statistics_of_far_positions() -> None:
    positions = np.random.default_rng(1).normal(size=(4, 50, 3)) + 1e5
    found = measure([positions[:1].astype(np.float32), positions[1:].astype(np.float32)])
    assert found["scale"] == pytest.approx(np.sqrt(3), rel=0.1)
    assert name_topology(np.zeros((0, 3), np.int32)) == name_topology(np.zeros((0, 3), np.int32))


def test_a_card(folder: Path, tmp_path: Path) -> None:
    card = tmp_path / "README.md"
    run = CliRunner().invoke(cli, ["pack", str(folder), str(tmp_path / "a-%d.tar"), "--shard-count", "2", "--card", str(card)])
    assert run.exit_code == 0, run.exception
    text = card.read_text()
    assert text.startswith("---\npretty_name: ") and "- n<1K\n---\n" in text
    for words in ("| sequences | 4 |", "| topologies | 2 |", "| shards | 2 |", "| codecs | pca (4) |", "max_diag", '"a-*.tar"'):
        assert words in text
    assert '"max_error": "0.1%"' in text
    mine = text.replace("---\n\n", "license: mine\n---\n\n", 1).replace(FINISH, f"{FINISH}\n\nMy own text.")
    card.write_text(mine.replace("| sequences | 4 |", "| sequences | 9 |"))
    datasets.pack(folder, tmp_path / "b.tar", card=card)
    again = card.read_text()
    assert "license: mine" in again and "My own text." in again and "| sequences | 4 |" in again and '"b.tar"' in again
    card.write_text("My own page.")
    with pytest.raises(InputError, match=rf"has no region for gvpipe; add the lines {BEGIN}"):
        datasets.pack(folder, tmp_path / "c.tar", card=card)
    assert card.read_text() == "My own page." and not (tmp_path / "c.tar").exists()
