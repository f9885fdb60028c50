"""The commands `pack`, and `info` of shards."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from sequences import waving

import gvpipe
from gvpipe.cli.choices import parse_bytes
from gvpipe.cli.commands import cli
from gvpipe.foundation.errors import CorruptFile, InputError


def test_pack_and_info(tmp_path: Path) -> None:
    folder = tmp_path / "sequences"
    folder.mkdir()
    gvpipe.encode(waving(5, 4), folder / "a.mp4", "pca", bare=True)
    (folder / "a.json").write_text('{"max_diag": 0.0005}')
    run, target = CliRunner(), str(tmp_path / "set-%02d.tar")
    packed = run.invoke(cli, ["pack", str(folder), target, "--shard-size", "1MB", "--json"], catch_exceptions=False)
    assert json.loads(packed.stdout)["shards"] == [str(tmp_path / "set-00.tar")]
    text = run.invoke(cli, ["info", str(tmp_path / "set-*.tar")], catch_exceptions=False).stdout
    assert "1 sequence (1 pca)" in text and "vertices: 25 to 25" in text and "worst max_diag: 0.0005, sample a" in text
    (folder / "b.mp4").write_bytes(b"no video")
    left = run.invoke(cli, ["pack", str(folder), str(tmp_path / "more.tar")])
    assert isinstance(left.exception, InputError) and "1 files of" in str(left.exception) and "b.mp4" in str(left.exception)
    data = bytearray((tmp_path / "more.tar").read_bytes())
    data[700] ^= 1
    (tmp_path / "more.tar").write_bytes(data)
    damaged = run.invoke(cli, ["info", str(tmp_path / "more.tar")])
    assert isinstance(damaged.exception, CorruptFile) and "sample 'a' at byte 512" in str(damaged.exception)


@pytest.mark.parametrize(("text", "count"), [("500", 500), ("1.5kB", 1500), ("2 GB", 2_000_000_000), ("3m", 3_000_000)])
def test_sizes(text: str, count: int) -> None:
    assert parse_bytes("--shard-size", text) == count


@pytest.mark.parametrize("text", ["", "0", "-1", "1 XB", "many"])
def test_sizes_that_are_none(text: str) -> None:
    with pytest.raises(Exception, match="a number of bytes is needed"):
        parse_bytes("--shard-size", text)
