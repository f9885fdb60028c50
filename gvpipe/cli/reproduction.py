"""`reproduce`: the numbers of the codecs' papers, measured here."""

from __future__ import annotations

import click

from gvpipe.cli.console import Output, output_options


@click.command()
@click.argument("papers", metavar="PAPERS...", nargs=-1)
@click.option("--data", default="data", show_default=True, metavar="DIR", help="Folder with the sequences, NAME.npz.")
@click.option("--quick", is_flag=True, help="Three qualities in place of six, without the largest sequence.")
@click.option("--out", "folder", metavar="DIR", help="Write reproduction.json, reproduction.md and curves.json there.")
@output_options
def reproduce(papers: tuple[str, ...], data: str, quick: bool, folder: str | None, out: Output) -> None:
    """Measure what the papers of mcgv, pca, laplacian and pdct claim, and say which numbers hold.

    Curves that an earlier run left in --out are not measured again. Baselines come from `pip install ./baselines`.

    \b
    gvpipe reproduce laplacian --data sequences --out results
    gvpipe reproduce mcgv pca laplacian pdct --data sequences --quick
    """
    from gvpipe.benchmark.reproduction import reproduce as reproducing

    with out.progress() as progress:
        made = reproducing.reproduce(papers or tuple(reproducing.PAPERS), data, quick, folder, progress)
    out.json(made.to_json())
    out.text(made.markdown().rstrip("\n"))
