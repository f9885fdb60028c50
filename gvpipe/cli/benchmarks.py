"""`bench`, which measures codecs, and `plot`, which draws what was measured."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import click

from gvpipe.cli.console import Output, output_options, print_options
from gvpipe.cli.encode_options import parse_pairs
from gvpipe.cli.pipes import PIPE

SWEEP_OPTIONS = ("qualities", "pairs", "sted", "external", "external_decode")  # not for --scale
SCALE_OPTIONS = ("vertices", "frames", "limit")  # for --scale alone


@click.command()
@click.argument("sources", metavar="SEQUENCES...", nargs=-1)
@click.option(
    "--codecs",
    metavar="ID,ID...",
    help="What to measure, ID or ID:KEY=VALUE. [default: all, mcgv in 2 or 3 ways; none with --external]",
)
@click.option("--qualities", metavar="Q,Q...", help="Qualities to measure. [default: 0,20,40,60,75,90,100]")
@click.option("--set", "pairs", multiple=True, metavar="KEY=VALUE", help="A setting for all these codecs; repeat for more.")
@click.option("--kg", default="1,0.3,0.1", show_default=True, metavar="KG,KG...", help="Errors at which to tell rates.")
@click.option("--sted", metavar="STED,STED...", help="The same for this measure.")
@click.option("--external", metavar="COMMAND", help="Measure this program, too: 'encode {input} {output}'; frames are given.")
@click.option("--external-decode", metavar="COMMAND", help="How it decodes: 'decode {input} {output}'; it writes frames.")
@click.option("--external-format", type=click.Choice(["obj", "ply"]), default="obj", show_default=True, help="Of its frames.")
@click.option("--external-name", metavar="NAME", default="", help="Its name in tables. [default: the program's]")
@click.option(
    "--external-limit",
    type=click.FloatRange(0, min_open=True),
    default=3600.0,
    show_default=True,
    metavar="SECONDS",
    help="That each of its commands may take.",
)
@click.option("--scale", is_flag=True, help="Measure how time and memory grow with size, on meshes made for it.")
@click.option("--vertices", metavar="N,N...", help="With --scale. [default: 1000,10000,100000,1000000]")
@click.option("--frames", metavar="N,N...", help="With --scale. [default: 10,100,1000,10000]")
@click.option(
    "--limit", type=click.FloatRange(0, min_open=True), metavar="SECONDS", help="With --scale: end what takes longer."
)
@click.option(
    "--json",
    "target",
    is_flag=False,
    flag_value=PIPE,
    metavar="[OUT.json]",
    help="Write all results to this file, or print one JSON object and nothing else.",
)
@print_options
def bench(sources: tuple[str, ...], scale: bool, target: str | None, out: Output, **options: Any) -> None:
    """Measure rate, distortion, times and memory of codecs, every round trip verified; `gvpipe plot` draws the results.

    \b
    gvpipe bench a.npz b.npz --json out.json
    gvpipe bench a.npz --codecs mcgv,mcgv:prediction=affine,pca
    gvpipe bench a.npz --external 'enc {input} {output}' --external-decode 'dec {input} {output}'
    gvpipe bench --scale --limit 600 --json scale.json
    """
    if target not in (None, PIPE) and not target.lower().endswith(".json"):  # a sequence behind --json is not overwritten
        raise click.UsageError(f"--json {target}: the results' file ends in .json; put --json last to print them")
    out = replace(out, as_json=target == PIPE)
    _check_options(sources, scale, options)
    made, text = _run_scale(options, out) if scale else _run_sweep(sources, options, out)
    if target not in (None, PIPE):
        made.write(target)
    out.json(made.to_json())
    out.text(text)


@click.command()
@click.argument("report", metavar="REPORT.json")
@click.argument("folder", metavar="FOLDER")
@click.option("--peers", metavar="RESULTS.csv", help="Other codecs' results to draw beside, dashed.")
@output_options
def plot(report: str, folder: str, peers: str | None, out: Output) -> None:
    """Draw what `gvpipe bench --json REPORT.json` measured into FOLDER: a picture per sequence, or two of a --scale report."""
    from gvpipe.benchmark import plots, scale_plots
    from gvpipe.benchmark.json_results import read_results
    from gvpipe.benchmark.report import BenchReport
    from gvpipe.benchmark.scale_report import ScaleReport

    found = read_results(report, lambda given: (ScaleReport if _is_scale(given) else BenchReport).parse(given))
    if isinstance(found, BenchReport):
        drawn = plots.draw(found, folder, plots.read_peers(peers) if peers else None)
    elif peers:
        raise click.UsageError(f"--peers: {report} has costs by size, and no rates that other codecs' results go beside")
    else:
        drawn = scale_plots.draw(found, folder)
    out.json({"plots": [str(path) for path in drawn]})
    out.text("\n".join(map(str, drawn)))


def _check_options(sources: tuple[str, ...], scale: bool, options: dict[str, Any]) -> None:
    """Raise `click.UsageError` for options of one way to measure that are given to the other."""
    strange = next((key for key in (SWEEP_OPTIONS if scale else SCALE_OPTIONS) if options[key]), None)
    if strange:
        name = "--set" if strange == "pairs" else f"--{strange}"
        raise click.UsageError(f"{name} is {'not for --scale, which has default settings' if scale else 'for --scale alone'}")
    if options["limit"] is not None and not options["limit"] < float("inf"):
        raise click.UsageError(f"--limit {options['limit']}: a number of seconds is needed")
    if (options["external"] is None) != (options["external_decode"] is None):
        raise click.UsageError("--external and --external-decode go together: a program is measured by what it decodes")
    if scale and sources:
        raise click.UsageError(f"--scale makes its own sequences; leave {' '.join(sources)} out")
    if not scale and not sources:
        raise click.UsageError("a sequence is needed, or --scale")


def _run_sweep(sources: tuple[str, ...], options: dict[str, Any], out: Output) -> tuple[Any, str]:
    from gvpipe.benchmark import sweep
    from gvpipe.benchmark.tables import tables

    external = _parse_external(options)
    codecs = _parse_names(options["codecs"]) or ([] if external else sweep.default_codecs())
    qualities = _parse_numbers("--qualities", options["qualities"]) if options["qualities"] else list(sweep.QUALITIES)
    levels = {"kg": _parse_numbers("--kg", options["kg"])}
    if options["sted"]:
        levels["sted"] = _parse_numbers("--sted", options["sted"])
    with out.progress() as progress:
        made = sweep.run(sources, codecs, qualities, parse_pairs(options["pairs"]), progress)
        if external:
            theirs = []
            for i, source in enumerate(sources):
                if progress:
                    progress(f"{sweep.name_of(source)} {external.title}", i / len(sources))
                theirs.append(external.measure(source, qualities))
            made = replace(made, curves=[*made.curves, *theirs])
    return made, tables(made.curves, levels)


def _run_scale(options: dict[str, Any], out: Output) -> tuple[Any, str]:
    from gvpipe.benchmark import scale
    from gvpipe.benchmark.scale_report import table

    codecs = _parse_names(options["codecs"]) or scale.CODECS
    vertices = _parse_sizes("--vertices", options["vertices"]) or scale.VERTICES
    frames = _parse_sizes("--frames", options["frames"]) or scale.FRAMES
    with out.progress() as progress:
        made = scale.run(codecs, vertices, frames, options["limit"], progress)
    return made, table(made.scale)


def _is_scale(given: object) -> bool:
    return isinstance(given, dict) and "scale" in given


def _parse_external(options: dict[str, Any]) -> Any:
    """The program of ``--external``; None without one."""
    from gvpipe.benchmark.external import External

    if options["external"] is None:
        return None
    form, limit, name = (options[f"external_{key}"] for key in ("format", "limit", "name"))
    return External(options["external"], options["external_decode"], form, limit, name)


def _parse_names(text: str | None) -> list[str]:
    return [name.strip() for name in text.split(",")] if text else []


def _parse_sizes(option: str, text: str | None) -> list[int]:
    sizes = [round(number) for number in _parse_numbers(option, text)] if text else []
    if min(sizes, default=1) < 1:
        raise click.UsageError(f"{option} {text}: sizes start at 1")
    return sizes


def _parse_numbers(option: str, text: str) -> list[float]:
    try:
        return [float(number) for number in text.split(",")]
    except ValueError as exc:
        raise click.UsageError(f"{option} {text}: numbers with commas between are needed") from exc
