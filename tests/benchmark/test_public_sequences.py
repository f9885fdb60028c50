"""Fetching sequences, from a server on this machine."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import Finished
from file_server import serving
from sequences import waving

import gvpipe
from gvpipe.benchmark.public_sequences import SEQUENCES, PublicSequence, fetch_sequence, public_sequences
from gvpipe.foundation.errors import InputError

Run = Callable[..., Finished]


@pytest.fixture
def npz(tmp_path: Path) -> bytes:
    gvpipe.write(waving(5, 4), tmp_path / "source.npz")
    return (tmp_path / "source.npz").read_bytes()


def entry(data: bytes, url: str) -> PublicSequence:
    url = url.replace("a.mp4", "a.npz")  # the server has one file for all addresses
    return PublicSequence("sheet", url, hashlib.sha256(data).hexdigest(), len(data), "CC0", "", fps=0.0)


def test_fetched_once_and_whole(npz: bytes, tmp_path: Path) -> None:
    with serving(npz) as (url, served):
        path, is_new = fetch_sequence(entry(npz, url), tmp_path / "new" / "data")
        assert (path, is_new) == (tmp_path / "new" / "data" / "sheet.npz", True)
        assert fetch_sequence(entry(npz, url), tmp_path / "new" / "data") == (path, False)
        assert len(served.sent) == 1
    assert np.array_equal(gvpipe.read(path).read(0, 4), waving(5, 4).read(0, 4))


def test_anything_else_is_refused_and_leaves_nothing(npz: bytes, tmp_path: Path) -> None:
    with serving(npz) as (url, served):
        good = entry(npz, url)
        wrong_sum = dataclasses.replace(good, sha256="0" * 64)
        with pytest.raises(InputError, match="nothing was written"):
            fetch_sequence(wrong_sum, tmp_path / "data")
        with pytest.raises(InputError, match="are expected"):
            fetch_sequence(dataclasses.replace(good, bytes=len(npz) - 1), tmp_path / "data")
        served.cut = 100
        with pytest.raises(InputError, match="expected|cannot be fetched"):
            fetch_sequence(good, tmp_path / "data")
        served.status = 404
        with pytest.raises(InputError, match="cannot be fetched"):
            fetch_sequence(good, tmp_path / "data")
    assert not (tmp_path / "data").exists()
    for url in ("file:///etc/hostname", "nowhere"):
        with pytest.raises(InputError, match="cannot be fetched"):
            fetch_sequence(dataclasses.replace(good, url=url), tmp_path / "data")


def test_the_table_names_commits_and_checksums() -> None:
    assert len({one.name for one in SEQUENCES}) == len(SEQUENCES)
    for one in SEQUENCES:
        owner, repository, commit, *path = one.url.removeprefix("https://raw.githubusercontent.com/").split("/")
        assert owner and repository and path and len(bytes.fromhex(commit)) == 20
        assert len(bytes.fromhex(one.sha256)) == 32 and one.licence and one.what
    with pytest.raises(InputError, match="did you mean 'fox_walk'"):
        public_sequences(["fox_wlak"])


def test_command_line(run: Run) -> None:
    assert [one["name"] for one in json.loads(run("fetch-data", "--list", "--json").out)["sequences"]] == [
        one.name for one in SEQUENCES
    ]
    assert run("fetch-data").status == 2
    assert run("fetch-data", "fox").status == 1
