"""What the README and the page of pictures show runs as it stands."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from folders import ROOT, SAMPLES

import gvpipe
from gvpipe.cli.commands import cli

README = (ROOT / "README.md").read_text()
COMMANDS = (ROOT / "docs" / "cli.md").read_text()
ASSETS = (ROOT / "docs" / "assets.md").read_text()
PICTURES = (ROOT / "docs" / "render.md").read_text()


@pytest.fixture
def in_a_copy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory that holds the samples."""
    (tmp_path / "samples").symlink_to(ROOT / "samples")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_python_example(in_a_copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    exec(compile(example, "README.md", "exec"), {})
    assert "102 frames, (5332, 3) triangles, (2668, 3)" in capsys.readouterr().out
    assert (in_a_copy / "creature.npz").exists()


def test_example_of_pictures(in_a_copy: Path) -> None:
    (example,) = re.findall(r"```python\n(.*?)```", PICTURES, re.DOTALL)
    sequence = gvpipe.read("samples/creature.npz").part(0, 32)
    gvpipe.write(sequence, "walk.npz")
    gvpipe.encode(sequence, "walk.mp4", "pdct", quality=50)
    names: dict[str, Any] = {}
    exec(compile(example, "render.md", "exec"), names)
    assert (in_a_copy / "walk.png").exists()
    assert names["picture"].shape == (512, 512, 3) and 0 <= names["triangles"].max() < len(sequence.faces)


def test_examples_of_assets(in_a_copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    examples = re.findall(r"```python\n(.*?)```", ASSETS, re.DOTALL)
    assert len(examples) == 3
    for example in examples:
        exec(compile(example, "assets.md", "exec"), {})
    assert "['flag', 'pole'] ['cloth', 'steel']\n(3732, 2) (10, 675) image/png" in capsys.readouterr().out
    quad = gvpipe.decode("quad.mp4")
    assert quad.polygons is not None and quad.polygons.tolist() == [4]
    assert quad.attributes["group"].domain == "triangle"


def test_set_up_line_ends_in_commands_that_run(in_a_copy: Path) -> None:
    line = next(line for line in README.splitlines() if "gvpipe encode samples" in line)
    (in_a_copy / "samples").unlink()
    (in_a_copy / "samples").mkdir()
    gvpipe.write(gvpipe.read(SAMPLES / "creature.npz").part(0, 12), in_a_copy / "samples" / "creature.npz")
    commands = [shlex.split(part) for part in line.split("&&") if "bin/gvpipe " in part]
    assert [command[1] for command in commands] == ["encode", "decode"]
    for command in commands:
        result = CliRunner().invoke(cli, command[1:])
        assert result.exit_code == 0, result.output
    assert (in_a_copy / "creature.npz").exists()


def test_every_command_shown_exists() -> None:
    shown = set(re.findall(r"^gvpipe ([\w-]+)", COMMANDS, re.MULTILINE))
    assert set(cli.commands) <= shown


def test_links_lead_somewhere() -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert (ROOT / target).exists(), target


def test_the_moving_picture_loads_quickly() -> None:
    assert (ROOT / "docs" / "moving.gif").stat().st_size <= 300_000


def test_codecs_is_not_a_package() -> None:
    """An ``__init__.py`` in codecs/ would shadow Python's own ``codecs``."""
    assert not (ROOT / "codecs" / "__init__.py").exists()
