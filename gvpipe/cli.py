"""The command line: parse, call the library, print. Results go to standard output, everything else to standard error.

Exit status: 0 done, 1 one clear line on standard error, 2 wrong usage.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from gvpipe import __version__
from gvpipe.errors import GvpipeError

if TYPE_CHECKING:
    from gvpipe.codec import Progress
    from gvpipe.sequence import MeshSequence
    from gvpipe.web import ExportReport

CONTEXT = {"help_option_names": ["-h", "--help"], "max_content_width": 100}
as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")


def main() -> None:
    """Run the command line and exit."""
    try:
        status = cli(standalone_mode=False)
    except GvpipeError as exc:
        status = _fail(" ".join(str(exc).split()), 1)
    except click.UsageError as exc:
        exc.show()
        status = 2
    except click.ClickException as exc:
        exc.show()
        status = 1
    except (click.Abort, KeyboardInterrupt):
        status = _fail("interrupted; nothing was written", 130)
    except MemoryError:
        status = _fail("not enough memory; encode fewer frames or vertices at a time, or give the sequence as frame files", 1)
    except BrokenPipeError:  # the reader of our output left, as `| head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = 1
    except OSError as exc:  # files' own errors are GvpipeErrors already: what is left is our output, as on a full disk
        status = _fail(f"cannot print the result: {exc.strerror or exc}; free some space or print elsewhere", 1)
    sys.exit(status or 0)


@click.group(context_settings=CONTEXT)
@click.version_option(__version__, prog_name="gvpipe")
def cli() -> None:
    """Turn animated triangle meshes into small MP4 geometry videos, and back."""


@cli.command()
@click.argument("source", metavar="INPUT")
@click.argument("target", metavar="OUTPUT.mp4")
@click.option("--codec", default="mcgv", show_default=True, help="See `gvpipe codecs`; auto: the one with the smallest file.")
@click.option("--quality", type=float, help="0-100, higher is better; with a target, where the search begins. [default: 75]")
@click.option("--target-rmse", type=float, metavar="X", help="Largest rmse, as a part of the diagonal, such as 1e-4.")
@click.option("--target-kg", type=float, metavar="X", help="Largest KG error, percent, such as 0.1.")
@click.option("--target-bpvf", type=float, metavar="X", help="Most bits per vertex and frame.")
@click.option("--max-error", metavar="E", help="Bound for every vertex: model units, or 0.05% of the diagonal.")
@click.option("--set", "pairs", multiple=True, metavar="KEY=VALUE", help="A setting of the codec; repeat for more.")
@click.option("--segment", type=int, help="Most frames per segment. [default: 500]")
@click.option("--fps", type=float, help="Frames per second, instead of the input's.")
@click.option("--reorder", is_flag=True, help="Let the codec choose the vertex order: smaller.")
@as_json
def encode(
    source: str,
    target: str,
    codec: str,
    quality: float | None,
    target_rmse: float | None,
    target_kg: float | None,
    target_bpvf: float | None,
    max_error: str | None,
    pairs: tuple[str, ...],
    segment: int | None,
    fps: float | None,
    reorder: bool,
    as_json: bool,
) -> None:
    """Encode a mesh sequence as a geometry video.

    INPUT is an .npz (vertices (F,V,3), faces (T,3), fps), a folder of frame files (OBJ, PLY, STL, OFF, GLB), a glob
    ('walk/*.obj'), a pattern (walk/%04d.obj) or a geometry video.
    """
    from gvpipe import api
    from gvpipe.auto import AUTO
    from gvpipe.codec import codec_class, codec_ids

    targets = {"target_rmse": target_rmse, "target_kg": target_kg, "target_bpvf": target_bpvf, "max_error": max_error}
    if sum(value is not None for value in targets.values()) > 1:
        raise click.UsageError("give one of --target-rmse, --target-kg, --target-bpvf and --max-error")
    settings = _parse_pairs(pairs)
    given = {"quality": quality, "segment": segment, "reorder": reorder or None}
    settings.update({key: str(value) for key, value in given.items() if value is not None})
    chosen = [codec_class(name).from_texts(settings) for name in (codec_ids() if codec == AUTO else [codec])]
    with _progress() as progress:
        report = api.encode(source, target, chosen if codec == AUTO else chosen[0], progress, fps, **targets)  # type: ignore[arg-type]  # by name
    if report.not_carried:
        click.echo(f"Note: the file does not carry {', '.join(report.not_carried)}.", err=True)
    if as_json:
        return _print_json(report.to_json())
    shape = f"{report.frames} frames, {report.vertices} vertices"
    click.echo(f"{source} ({shape}) -> {target} ({_size(report.bytes)}, {report.bpvf:.3f} bits per vertex and frame)")
    seconds = dict(report.seconds)
    stages = ", ".join(f"{name} {value:.1f}" for name, value in seconds.items() if name != "encode" and value >= 0.05)
    click.echo(f"{seconds['encode']:.1f} s: {stages}")
    for tried in report.tried:
        keys = [key for key in ("bpvf", "rmse_diag", "kg", "max_diag") if tried[key] is not None]
        measures = ", ".join(f"{key} {tried[key]:.4g}" for key in keys)
        click.echo(f"  {tried['codec']} at quality {tried['quality']:.4g}: {tried['bytes']} bytes, {measures}")
    if report.reason:
        click.echo(report.reason)
    _print_sections(report.sections, report.vertices * report.frames)
    return None


@cli.command()
@click.argument("source", metavar="FILE.mp4")
@click.argument("target", metavar="OUTPUT")
@click.option("--start", type=int, default=0, show_default=True, help="First frame.")
@click.option("--stop", type=int, help="Frame after the last. [default: the end]")
@click.option("--lod", type=int, default=0, show_default=True, help="Level of detail: 0 the mesh, higher is coarser.")
def decode(source: str, target: str, start: int, stop: int | None, lod: int) -> None:
    """Decode a geometry video.

    OUTPUT is an .npz, or a pattern of frame files such as out/%04d.obj (also .ply, .stl, .off, .glb).
    """
    from gvpipe import api
    from gvpipe.sequence import MeshSequence

    player = api.open(source)
    start, stop = api.frame_range(player, start, stop)
    level = player.level(lod)
    part = _Part(level, start, stop)
    with _progress() as progress:
        part.progress = progress
        api.write(MeshSequence(part, level.faces, player.fps, name=source), target, start)
    click.echo(f"{source} -> {target} ({stop - start} frames, {part.shape[1]} vertices)")


@cli.command()
@click.argument("source", metavar="FILE.mp4")
@as_json
def info(source: str, as_json: bool) -> None:
    """Tell what a geometry video holds and where its bytes go."""
    from gvpipe import api

    found = api.info(source)
    if as_json:
        return _print_json(found.to_json())
    low, high = found.bounding_box["min"], found.bounding_box["max"]
    click.echo(f"{source}: {found.codec} version {found.version}")
    click.echo(f"{found.vertices} vertices, {found.triangles} triangles, {found.frames} frames at {found.fps:g} fps")
    click.echo("frame 0 lies in " + " x ".join(f"{a:g}..{b:g}" for a, b in zip(low, high, strict=True)))
    if len(found.levels) > 1:
        click.echo("levels of detail, vertices: " + ", ".join(f"{lod}: {count}" for lod, count in enumerate(found.levels)))
    click.echo(f"{_size(found.bytes)}, {found.bpvf:.3f} bits per vertex and frame:")
    _print_sections(found.sections, found.vertices * found.frames)
    return None


@cli.command()
@click.argument("reference", metavar="REFERENCE")
@click.argument("distorted", metavar="DISTORTED")
@as_json
def compare(reference: str, distorted: str, as_json: bool) -> None:
    """Measure how far DISTORTED is from REFERENCE; both are sequences or geometry videos."""
    from gvpipe import api, metrics

    with _progress() as progress:
        result = metrics.compare(
            api.read(reference), api.read(distorted), lambda done, of: progress("compare", done / of) if progress else None
        )
    values = result.to_json()
    if as_json:
        return _print_json(values)
    for name, value in values.items():
        if name != "frames":
            click.echo(f"{name:<14} {'not defined' if value is None else format(value, '.6g')}")
    return None


@cli.command("export-html")
@click.argument("source", metavar="FILE.mp4")
@click.argument("target", metavar="OUT.html")
@click.option("--up", type=click.Choice(["y", "z"]), default="y", show_default=True, help="The axis that stands upright.")
@click.option("--quality", type=float, help="0-100, where the file must be converted. [default: 75]")
@as_json
def export_html(source: str, target: str, up: str, quality: float | None, as_json: bool) -> None:
    """Write a web page of one file that plays a geometry video, without a network.

    Browsers read codec mcgv in its web profile; other files are converted, which adds an error that is told.
    """
    from gvpipe import web

    with _progress() as progress:
        report = web.export_html(source, target, up, quality, progress)
    if as_json:
        return _print_json(report.to_json())
    click.echo(f"{source} -> {target} ({_size(report.bytes)}, {_size(report.video_bytes)} of which are the geometry video)")
    _tell_conversion(report)
    return None


@cli.command()
@click.argument("source", metavar="FILE.mp4")
@click.option("--up", type=click.Choice(["y", "z"]), default="y", show_default=True, help="The axis that stands upright.")
def play(source: str, up: str) -> None:
    """Play a geometry video in your browser; print the path of the page where there is none."""
    import tempfile
    from pathlib import Path

    from gvpipe import web
    from gvpipe.web.browser import open_page

    with _progress() as progress:
        page = Path(tempfile.mkdtemp(prefix="gvpipe-")) / f"{Path(source).stem}.html"  # stays: the browser reads it later
        report = web.export_html(source, page, up, None, progress)
    _tell_conversion(report)
    click.echo(f"{source} plays in your browser" if open_page(page) else page)


@cli.command()
@click.argument("source", metavar="FILE.mp4|SEQUENCE")
@click.argument("target", metavar="OUT.png|.gif|.mp4")
@click.option("--frame", type=int, help="Only this frame; negative counts from the end. [default: 0 for .png, else all]")
@click.option("--size", default="512", show_default=True, metavar="N|WxH", help="Pixels.")
@click.option(
    "--view", default="three-quarter", show_default=True, help="front, back, left, right, top, bottom or AZIMUTH,ELEVATION."
)
@click.option("--up", type=click.Choice(["x", "y", "z"]), default="y", show_default=True, help="The axis that is up.")
@click.option("--turntable", is_flag=True, help="Let the camera go once around.")
@click.option("--follow", is_flag=True, help="Let the camera go with the mesh.")
@click.option("--error-of", "error_of", metavar="REFERENCE", help="Colour each vertex by its distance from REFERENCE's.")
@click.option("--error-max", type=float, metavar="PERCENT", help="Where the colours end. [default: the largest error drawn]")
@click.option("--shading", type=click.Choice(["smooth", "flat"]), default="smooth", show_default=True)
def render(source: str, target: str, size: str, **options: Any) -> None:
    """Paint a geometry video or a sequence as a picture or a film; needs no display and no GPU."""
    from gvpipe.rendering.pictures import parse_size, render

    pixels = parse_size(size)
    with _progress() as progress:
        render(source, target, size=pixels, progress=progress, **options)
    click.echo(f"{source} -> {target} ({pixels[0]}x{pixels[1]}, {_size(os.path.getsize(target))})")


@cli.command()
@click.argument("sources", metavar="SEQUENCES...", nargs=-1, required=True)
@click.option("--codecs", "codec_list", metavar="ID,ID...", help="Codecs to measure, ID or ID:KEY=VALUE. [default: all]")
@click.option("--qualities", metavar="Q,Q...", help="Qualities to measure. [default: 0,20,40,60,75,90,100]")
@click.option("--set", "pairs", multiple=True, metavar="KEY=VALUE", help="A setting for all these codecs; repeat for more.")
@click.option("--kg", default="1,0.3,0.1", show_default=True, metavar="KG,KG...", help="Errors at which to tell rates.")
@click.option("--sted", metavar="STED,STED...", help="The same for this measure.")
@click.option("--json", "target", metavar="OUT.json", help="Write all results to this file.")
@click.option("--plot", "report", metavar="OUT.json", help="Measure nothing: draw these results into the folder given.")
@click.option("--peers", metavar="RESULTS.csv", help="With --plot: other codecs' results to draw beside.")
def bench(
    sources: tuple[str, ...],
    codec_list: str | None,
    qualities: str | None,
    pairs: tuple[str, ...],
    kg: str,
    sted: str | None,
    target: str | None,
    report: str | None,
    peers: str | None,
) -> None:
    """Measure rate, distortion, times and memory of codecs, every round trip verified; or draw such results.

    \b
    gvpipe bench a.npz b.npz --json out.json
    gvpipe bench a.npz --codecs mcgv,mcgv:prediction=blended,pca
    gvpipe bench --plot out.json plots/
    """
    from gvpipe import bench as benches
    from gvpipe.codec import codec_ids
    from gvpipe.curves import tables

    if report is not None:
        from gvpipe import plots

        if len(sources) != 1:
            raise click.UsageError("--plot OUT.json needs one folder to draw into")
        drawn = plots.draw(benches.Report.read(report), sources[0], plots.read_peers(peers) if peers else None)
        click.echo("\n".join(map(str, drawn)))
        return
    chosen = [name.strip() for name in codec_list.split(",")] if codec_list else codec_ids()
    wanted = _parse_numbers("--qualities", qualities) if qualities else list(benches.QUALITIES)
    levels = {"kg": _parse_numbers("--kg", kg), **({"sted": _parse_numbers("--sted", sted)} if sted else {})}
    with _progress() as progress:
        made = benches.run(sources, chosen, wanted, _parse_pairs(pairs), progress)
    if target:
        made.write(target)
    click.echo(tables(made.curves, levels))


@cli.command()
def codecs() -> None:
    """List the codecs and their settings."""
    import dataclasses

    from gvpipe.codec import codec_class, codec_ids

    for name in codec_ids():
        codec = codec_class(name)
        defaults = " ".join(f"{field.name}={field.default}" for field in dataclasses.fields(codec))
        click.echo(f"{name}: {codec.summary}; {defaults}")


class _Part:
    """Some frames of a sequence, which tell how far they have been read."""

    def __init__(self, sequence: MeshSequence, start: int, stop: int) -> None:
        self._sequence, self._start = sequence, start
        self.shape = (stop - start, sequence.n_vertices, 3)
        self.progress: Progress | None = None

    def __getitem__(self, key: slice, /) -> Any:
        first, last, _ = key.indices(self.shape[0])
        if self.progress:
            self.progress("decode", last / self.shape[0])
        return self._sequence.read(self._start + first, self._start + last)


@contextlib.contextmanager
def _progress() -> Iterator[Progress | None]:
    """A bar per stage on standard error, where that is a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress as Bars

    with Bars(console=Console(stderr=True), transient=True) as bars:
        tasks: dict[str, Any] = {}

        def show(stage: str, done: float) -> None:
            for name, task in tasks.items():
                if name != stage:
                    bars.update(task, completed=1.0)
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=1.0)
            bars.update(tasks[stage], completed=done)

        yield show


def _parse_numbers(option: str, text: str) -> list[float]:
    try:
        return [float(number) for number in text.split(",")]
    except ValueError as exc:
        raise click.UsageError(f"{option} {text}: numbers with commas between are needed") from exc


def _parse_pairs(pairs: tuple[str, ...]) -> dict[str, str]:
    settings = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not equals:
            raise click.UsageError(f"--set {pair}: KEY=VALUE is needed, such as --set clusters=30")
        settings[key.strip()] = value.strip()
    return settings


def _tell_conversion(report: ExportReport) -> None:
    """Say on standard error what the page shows instead of the file's own frames."""
    if report.converted:
        rmse, largest = ("not defined" if v is None else f"{v:.1e}" for v in (report.rmse_diag, report.max_diag))
        click.echo(
            f"Note: browsers cannot read {report.converted}; the page holds a conversion to mcgv, web profile, which adds an "
            f"error of rmse {rmse}, at most {largest}, of the diagonal.",
            err=True,
        )


def _print_json(values: dict[str, Any]) -> None:
    click.echo(json.dumps(values, allow_nan=False))


def _print_sections(sections: dict[str, int], n_samples: int) -> None:
    from rich.console import Console

    from gvpipe.breakdown import section_table

    console = Console(file=sys.stdout, width=100, color_system=None)
    with console.capture() as captured:
        console.print(section_table(sections, n_samples))
    text = "\n".join(line.rstrip() for line in captured.get().splitlines())
    encoding = sys.stdout.encoding or "utf-8"
    click.echo(text.encode(encoding, "replace").decode(encoding))


def _size(count: int) -> str:
    return f"{count / 1e6:.2f} MB" if count >= 1e6 else f"{count / 1e3:.1f} kB"


def _fail(message: str, status: int) -> int:
    click.echo(f"Error: {message}", err=True)
    return status
