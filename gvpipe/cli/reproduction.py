"""`reproduce`, which measures the numbers of papers, and `fetch-data`, which brings public sequences."""

from __future__ import annotations

import click

from gvpipe.cli.console import Output, output_options


@click.command()
@click.argument("papers", metavar="PAPERS...", nargs=-1)
@click.option("--data", default="data", show_default=True, metavar="DIR", help="Folder with the sequences, NAME.npz.")
@click.option("--quick", is_flag=True, help="Three qualities in place of six, without the largest sequence.")
@click.option("--out", "folder", metavar="DIR", help="Write reproduction.json, reproduction.md and curves.json there.")
@click.option("--again", metavar="ID,ID...", help="Measure these codecs anew, though --out has their curves; all: every codec.")
@output_options
def reproduce(papers: tuple[str, ...], data: str, quick: bool, folder: str | None, again: str | None, out: Output) -> None:
    """Measure what the papers of mcgv, pca, laplacian and pdct claim, and say which numbers hold; baselines: theirs.

    Without PAPERS: all. Curves and claims are kept in --out as they are found, and a later run goes on there. It measures
    no curve twice, except with --again. Baselines come from `pip install ./baselines`.

    \b
    gvpipe reproduce --data sequences --out results
    gvpipe reproduce laplacian --data sequences --out results --again laplacian,coddyac
    gvpipe reproduce mcgv pca laplacian pdct --data sequences --quick
    """
    from gvpipe.benchmark.reproduction import reproduce as reproducing

    with out.progress() as progress:
        wanted = papers or tuple(reproducing.PAPERS)
        made = reproducing.reproduce(wanted, data, quick, folder, progress, again.split(",") if again else ())
    out.json(made.to_json())
    out.text(made.markdown().rstrip("\n"))


@click.command("fetch-data")
@click.argument("names", metavar="NAMES...", nargs=-1)
@click.option("--data", default="data", show_default=True, metavar="DIR", help="Folder that takes NAME.npz.")
@click.option("--list", "lists", is_flag=True, help="List the sequences with licence, size and address.")
@click.option("--all", "everything", is_flag=True, help="Fetch all that are listed.")
@output_options
def fetch_data(names: tuple[str, ...], data: str, lists: bool, everything: bool, out: Output) -> None:
    """Fetch public sequences, each checked against its SHA-256, for `gvpipe bench` and `gvpipe reproduce`.

    \b
    gvpipe fetch-data --list
    gvpipe fetch-data fox_walk knight_spin --data sequences
    """
    from gvpipe.benchmark.public_sequences import SEQUENCES, fetch_sequence, public_sequences

    if lists:
        out.json({"sequences": [sequence.to_json() for sequence in SEQUENCES]})
        for one in SEQUENCES:
            out.text(f"{one.name}: {one.what}; {one.licence}; {one.bytes} bytes, {one.url}")
        return
    if bool(names) == everything:
        raise click.UsageError("give names of sequences, or --all; --list shows them")
    wanted = list(SEQUENCES) if everything else public_sequences(names)
    made = []
    with out.progress() as progress:
        for sequence in wanted:
            path, is_new = fetch_sequence(sequence, data, progress)
            made.append({"name": sequence.name, "path": str(path), "fetched": is_new, "licence": sequence.licence})
    out.json({"sequences": made})
    for row in made:
        out.text(f"{row['path']}{'' if row['fetched'] else ', which was there'}: {row['licence']}")
