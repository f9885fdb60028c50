"""``python -m fuzz``: the command line."""

from __future__ import annotations

import json
import os
import signal
import sys
from pathlib import Path
from typing import Any

import click

from fuzz.limits import BAD
from fuzz.seeds import FOLDER
from fuzz.session import KINDS, Session
from fuzz.targets import Options
from fuzz.worker import memory_folder

OF_PARSERS = click.Choice(["", "video", "mesh", "web", "strange"])


@click.command()
@click.option("--seconds", default=600.0, show_default=True, help="How long cases run, by the clock.")
@click.option("--cases", default=0, help="Cases of each parser, instead of a time; results then repeat exactly.")
@click.option("--seed", default=1, show_default=True, help="Seed of the random numbers: the same cases for the same seed.")
@click.option("--first", default=0, help="Number of the first case of each parser.")
@click.option("--target", "targets", multiple=True, help="A parser; may be given several times. All by default.")
@click.option("--without", multiple=True, help="A parser to leave out; may be given several times.")
@click.option(
    "--kind", type=click.Choice(["", "video", "mesh", "web", "strange"]), default="", help="Parsers of one kind alone."
)
@click.option("--workers", default=os.cpu_count() or 1, show_default=True, help="Processes.")
@click.option("--seeds", default=str(FOLDER), help="Folder of seed files; made when it is missing.")
@click.option("--more", default="", help="A folder of mesh files that are seeds too.")
@click.option("--found", default=str(FOLDER.with_name("found")), help="Folder for the files of cases that fail.")
@click.option("--indices", is_flag=True, help="Kernels refuse indices out of bounds, and negative ones that would wrap.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def main(as_json: bool, **given: object) -> None:
    """Run mutated files through every parser; exit status 1 if any went wrong."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))  # workers are ended, and counts are kept
    folder = Path(memory_folder() or FOLDER.with_name("cases"), f"gvpipe-fuzz-{os.getpid()}")
    session = Session(Options(**given, folder=str(folder)), lambda line: click.echo(line, err=True))  # type: ignore[arg-type]
    session.run()
    session.reduce()
    result = session.to_json()
    click.echo(json.dumps(result, indent=1) if as_json else _table(result))
    sys.exit(any(count[kind] for count in result["targets"].values() for kind in BAD))


def _table(result: dict[str, Any]) -> str:
    rows = [f"{'target':14} {'cases':>8} " + " ".join(f"{kind:>8}" for kind in KINDS) + f" {'cases/s':>8}"]
    for name, count in result["targets"].items():
        rows.append(
            f"{name:14} {count['cases']:8} "
            + " ".join(f"{count[kind]:8}" for kind in KINDS)
            + f" {count['cases_per_second']:8}"
        )
    return "\n".join(
        [*rows, f"{result['cases']} cases, {result['seconds']:.0f} s, {len(result['findings'])} kinds of findings"]
    )


if __name__ == "__main__":
    main()
