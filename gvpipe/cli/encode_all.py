"""``gvpipe encode-all``: a geometry video for each of many sequences."""

from __future__ import annotations

from typing import Any

import click

from gvpipe.cli.console import Output, output_options
from gvpipe.cli.encode_options import encode_options, parse_encoding


@click.command("encode-all")
@click.argument("sources", metavar="INPUTS...", nargs=-1, required=True)
@click.argument("folder", metavar="FOLDER")
@encode_options
@click.option("--workers", type=int, metavar="N", help="Encode N sequences at a time. [default: as many as cores]")
@click.option("--each", is_flag=True, help="With --codec auto: each sequence tries all codecs. [default: three, for all]")
@click.option("--scheduler", metavar="ADDRESS", help="Encode them on a Dask cluster, such as tcp://host:8786.")
@output_options
def encode_all(
    sources: tuple[str, ...], folder: str, workers: int | None, scheduler: str | None, each: bool, out: Output, **options: Any
) -> None:
    """Encode many mesh sequences, a geometry video each, into FOLDER.

    INPUTS are globs in quotes ('captures/**/*.glb'), folders with all sequences below them, or files. Outputs keep the
    inputs' folders. FOLDER/manifest.jsonl has a line for each sequence; the same command again does what is left. A sequence
    that fails is listed in the end, and the exit status is 1.
    """
    from gvpipe.batch.runs import encode_all
    from gvpipe.foundation.notes import count

    asked = parse_encoding(options)

    with out.progress() as progress:
        report = encode_all(
            sources, folder, asked.codec, progress, workers=workers, scheduler=scheduler, each=each, **asked.keywords
        )
    if report.decided:
        out.note(report.decided)
    for note, number in report.notes.items():
        out.note(f"{note} ({number} of {count(report.sequences, 'sequence')})")
    if report.left_out:
        out.note(f"left out, of no format that gvpipe reads: {count(report.left_out, 'file')}")
    out.json(report.to_json())
    counts = f"{report.encoded} encoded, {report.skipped} were done, {len(report.failed)} failed"
    out.text(f"{count(report.sequences, 'sequence')}: {counts}; {report.bytes / 1e6:.2f} MB in {report.seconds:.1f} s")
    out.text(f"manifest: {report.manifest}")
    for failed in report.failed:
        name, error = failed["input"], failed["error"]
        click.echo(f"Error: {error if error.startswith(name) else f'{name}: {error}'}", err=True)
    if report.failed:
        click.get_current_context().exit(1)
