"""A program of somebody else as a row of the bench: its bytes and errors are what it leaves; failures are one error each."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import Finished

from gvpipe.benchmark.external import External
from gvpipe.foundation.errors import InputError

Run = Callable[..., Finished]
ENCODE = """
import pathlib, sys
given, output, digits = sys.argv[1:]
frames = sorted(pathlib.Path(given).iterdir())
lines = []
for frame in frames:
    words = [line.split() for line in frame.read_text().splitlines()]
    rounded = [w[:1] + [str(round(float(x), int(digits))) for x in w[1:]] if w[:1] == ['v'] else w for w in words]
    lines.append('\\n'.join(' '.join(w) for w in rounded))
pathlib.Path(output + '.txt').write_text('\\f'.join(lines))
"""
DECODE = """
import pathlib, sys
folder = pathlib.Path(sys.argv[2])
folder.mkdir()
for i, frame in enumerate(pathlib.Path(sys.argv[1] + '.txt').read_text().split('\\f')):
    (folder / f'{i:03}.obj').write_text(frame)
"""
FAIL = "import sys; sys.exit('no licence: ' + sys.argv[1])"
KEEP = "import pathlib, sys; pathlib.Path(sys.argv[2]).write_text('x')"
REVERSE = DECODE.replace("frame)", "'\\n'.join(sorted(frame.splitlines(), key=lambda line: line[:1] != 'v')[:-1]))")


@pytest.fixture
def program(tmp_path: Path) -> Callable[..., str]:
    """A command that runs a script."""

    def command(code: str, more: str = "") -> str:
        path = tmp_path / f"program{len(list(tmp_path.glob('program*')))}.py"
        path.write_text(code, "utf-8")
        return f"'{sys.executable}' -S '{path}' {{input}} {{output}} {more}".strip()

    return command


def test_bytes_and_errors_are_those_of_what_it_leaves(sheet: Path, program: Callable[..., str]) -> None:
    curve = External(program(ENCODE, "{quality}"), program(DECODE), name="rounding").measure(str(sheet), [3, 1])
    assert (curve.codec, [point["quality"] for point in curve.points]) == ("rounding", [1, 3])
    coarse, fine = curve.points
    assert 0 < coarse["bytes"] < fine["bytes"]
    assert coarse["bpvf"] == pytest.approx(8 * coarse["bytes"] / (curve.vertices * curve.frames))
    assert 0.02 < coarse["max"] <= 0.051 * 3**0.5 and 0.0002 < fine["max"] <= 0.00051 * 3**0.5
    assert coarse["kg"] > fine["kg"] > 0 and fine["encode_s"] > 0


def test_every_failure_is_one_clear_error(sheet: Path, program: Callable[..., str]) -> None:
    encode, decode = program(ENCODE, "5"), program(DECODE)
    wrong = [
        (External(program(FAIL), decode), "failed with status 1: no licence"),
        (External("no-such-program {input} {output}", decode), "cannot be started"),
        (External(program("pass"), decode), "left nothing at {output}"),
        (External(encode, program("pass")), "left nothing at {output}; a folder of frames"),
        (External(encode, program(KEEP)), "cannot be read"),
        (External(encode, program(REVERSE)), "another mesh"),
        (External(program("import time; time.sleep(60)"), decode, limit=0.2), "took more than 0.2 seconds"),
    ]
    for external, message in wrong:
        with pytest.raises(InputError) as raised:
            external.measure(str(sheet), [50])
        assert message in str(raised.value)
    for command, message in (("enc {input}", "has no {output}"), ("enc '{input} {output}", "cannot be split")):
        with pytest.raises(InputError, match=message):
            External(command, command)


def test_command_line(run: Run, sheet: Path, program: Callable[..., str], tmp_path: Path) -> None:
    commands = ["--external", program(ENCODE, "4"), "--external-decode", program(DECODE), "--external-name", "rounding"]
    done = run("bench", sheet, *commands, "--json", tmp_path / "out.json")
    assert "| sheet | rounding | - |" in done.out
    (curve,) = json.loads((tmp_path / "out.json").read_text())["curves"]
    assert curve["codec"] == "rounding" and curve["points"][0]["quality"] is None
    assert "go together" in run("bench", sheet, *commands[:2]).err
