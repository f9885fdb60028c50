"""The command line: parse, call the library, print. Results go to standard output, everything else to standard error.

What is printed, and how much of it, is `gvpipe.cli.console`'s; ``-`` in place of a file's name is `gvpipe.cli.pipes`'.

Exit status: 0 done, 1 one clear line on standard error, 2 wrong usage, 130 interrupted, 128 + n ended by signal n.
"""

from __future__ import annotations

import os
import signal
import sys
import traceback
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from gvpipe import __version__
from gvpipe.cli.audio_options import audio_options, parse_audio, sound_path, write_beside
from gvpipe.cli.benchmarks import bench, plot
from gvpipe.cli.codecs import codecs, new_codec
from gvpipe.cli.console import Output, compress_option, is_verbose, output_options, texture_options, unlimited_option
from gvpipe.cli.conversion import convert
from gvpipe.cli.encode_all import encode_all
from gvpipe.cli.encode_options import encode_options, parse_encoding, parse_settings
from gvpipe.cli.page_options import page_options
from gvpipe.cli.pipes import PIPE, STDIN, STDOUT, VIDEO_SUFFIXES, is_video, shown, source_path, target_path
from gvpipe.cli.process import Ended, collect_seldom, ending_by_exception, replace_closed_streams
from gvpipe.cli.reproduction import fetch_data, reproduce
from gvpipe.foundation.atomic import remove_abandoned_folders
from gvpipe.foundation.errors import GvpipeError, InputError, TopologyChange
from gvpipe.foundation.text import escaped

if TYPE_CHECKING:
    from gvpipe.encoding.report import Report
    from gvpipe.metrics.frame_metrics import FrameMetric
    from gvpipe.metrics.texture_errors import TextureErrors
    from gvpipe.model.sequence import MeshSequence
    from gvpipe.web import ExportReport

CONTEXT = {"help_option_names": ["-h", "--help"], "max_content_width": 100}
LIVE_OPTIONS = {"mesh", "fps", "codec", "quality", "segment", "reorder", "pairs"}  # that `encode --live` knows


def main() -> None:
    """Run the command line and exit."""
    collect_seldom()
    replace_closed_streams()
    try:
        with ending_by_exception():
            status = cli(standalone_mode=False, prog_name="gvpipe")
    except GvpipeError as exc:
        status = _fail(_one_line(exc), 1)
    except click.ClickException as exc:
        vars(exc)["message"] = escaped(exc.message, has_lines=True)  # it may name a file
        exc.show()
        status = 2 if isinstance(exc, click.UsageError) else 1
    except (click.Abort, KeyboardInterrupt) as exc:
        status = _fail(f"interrupted; {_left(exc.__cause__ or exc)}", 130)
    except Ended as exc:
        status = _fail(f"ended by {signal.Signals(exc.number).name}; {_left(exc)}", 128 + exc.number)
    except MemoryError:
        status = _fail(
            "not enough memory; take fewer frames at a time (encode: --frames or --segment, decode: --start and --stop)", 1
        )
    except BrokenPipeError:  # the reader of our output left, as `| head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = 1
    except OSError as exc:  # those of files that are read or written are GvpipeErrors already
        if is_verbose(sys.argv[1:]):
            traceback.print_exc()
        what = f"{exc.filename}: " if exc.filename else ""
        status = _fail(f"{what}{exc.strerror or exc}; check the path, its permissions and the disk", 1)
    except Exception as exc:
        if is_verbose(sys.argv[1:]):
            traceback.print_exc()
        status = _fail(f"unexpected {type(exc).__name__}: {_one_line(exc)}; report what --verbose prints", 1)
    sys.exit(status or 0)


@click.group(context_settings=CONTEXT)
@click.version_option(__version__, prog_name="gvpipe")
def cli() -> None:
    """Turn animated triangle meshes into small MP4 geometry videos, and back."""
    remove_abandoned_folders()


@cli.command()
@click.argument("sources", metavar="INPUT...", nargs=-1, required=True)
@click.argument("target", metavar="OUTPUT.mp4")
@encode_options
@audio_options
@click.option("--split", is_flag=True, help="Write a file for each run of frames with the same triangles: NAME-000.mp4, ...")
@click.option(
    "--live",
    is_flag=True,
    help="Write the file while frames come on standard input, float32 positions each; --mesh has the triangles.",
)
@click.option(
    "--workers",
    type=int,
    metavar="N",
    help="Code segments in N processes: same bytes. Not for codec mcgv. [default: a minute of work gets one for each core]",
)
@click.option("--scheduler", metavar="ADDRESS", help="Code them on a Dask cluster, such as tcp://host:8786.")
@texture_options
@output_options
def encode(
    sources: tuple[str, ...],
    target: str,
    split: bool,
    live: bool,
    workers: int | None,
    scheduler: str | None,
    texture: str | None,
    texture_video: str | None,
    out: Output,
    **options: Any,
) -> None:
    """Encode a mesh sequence as a geometry video.

    INPUT is an .npz (vertices (F,V,3), faces (T,3), fps), a scene (animated .glb or .gltf, .usd, .abc, .fbx), a simulation
    (.pvd, .vtkhdf, .xdmf, .exo, .case), a point cache (.pc2, .mdd, .npy; with --mesh), a folder of frame files (OBJ, PLY, STL,
    OFF, GLB, VTP, VTU), a glob ('walk/*.obj', or without the quotes), a pattern (walk/%04d.obj, walk/####.obj,
    'walk/$F4.obj'), a geometry video, or - for an .npz or a geometry video on standard input. Stores that fsspec knows are
    read, too (s3://bucket/walk.npz). OUTPUT - is standard output.
    """
    from gvpipe import api
    from gvpipe.captures.splitting import with_sounds, write_runs
    from gvpipe.cli.choices import parse_texture
    from gvpipe.cli.process import give_back_memory
    from gvpipe.playback import files

    if len(sources) > 1 and (target != PIPE and not target.lower().endswith(VIDEO_SUFFIXES)):
        message = f"{len(sources) + 1} files are given, and the last, {target}, is no .mp4; end with the output's name"
        raise click.UsageError(message, click.get_current_context())
    if len(sources) > 1 and PIPE in sources:
        raise click.UsageError("- is one input among others; give it alone", click.get_current_context())
    if split and target == PIPE:
        raise click.UsageError("--split writes several files, and OUTPUT is -; give a file's name", click.get_current_context())
    shown_by = parse_texture(texture, texture_video)
    if live:
        more = {"split": split, "workers": workers, "scheduler": scheduler, "texture": shown_by}
        _encode_live(sources, target, {**options, **more}, out)
        return
    if split and shown_by is not None:
        raise click.UsageError("--split makes several films, and --texture is for one; encode each run with --frames")
    if (workers is not None or scheduler is not None) and (split or PIPE in sources):
        message = "--workers and --scheduler read INPUT by its path, as a whole; leave out --split, and name no -"
        raise click.UsageError(message, click.get_current_context())
    sound = parse_audio(options)
    asked = parse_encoding(options)
    give_back_memory()
    with source_path(sources[0]) as first, target_path(target, ".mp4") as path, out.progress() as progress:
        source = first if len(sources) == 1 else list(sources)
        if split:
            reading = {**asked.reading, "volume": bool(asked.reading["volume"])}
            runs = files.read_runs(source, **reading, unlimited=asked.unlimited)
            runs = with_sounds(runs, sound, asked.reading["frames"])
            written = write_runs(
                runs, target, lambda run, own: api.encode(run.sequence, own, asked.codec, progress, **asked.making)
            )
        else:
            shared = "auto" if workers is None and PIPE not in sources else workers
            keywords = {**asked.keywords, **sound, "workers": shared, "scheduler": scheduler, "texture": shown_by}
            report = api.encode(source, path, asked.codec, progress, **keywords)
    out = out.carrying(target)
    name = shown(sources[0], STDIN) + (f" and {len(sources) - 1} more" if len(sources) > 1 else "")
    if not split:
        out.json(report.to_json())
        _print_report(out, report, name, shown(target, STDOUT))
        return
    spans = [{"output": file, "start": run.start, "stop": run.stop} for (file, _), run in zip(written, runs, strict=True)]
    out.json({"files": [{**span, **report.to_json()} for span, (_, report) in zip(spans, written, strict=True)]})
    for (file, report), run in zip(written, runs, strict=True):
        _print_report(out, report, f"{name}, frames {run.start}:{run.stop}", file)


def _encode_live(sources: tuple[str, ...], target: str, options: dict[str, Any], out: Output) -> None:
    """Write a file while its frames come."""
    from dataclasses import asdict

    from gvpipe.cli.live_input import encode_live

    if any(parse_audio(options).values()):
        raise click.UsageError("--live writes no sound; add it later: gvpipe restream OUTPUT.mp4 NEW.mp4 --audio FILE")
    if any(options[name] not in (None, False, ()) for name in options.keys() - LIVE_OPTIONS):
        raise click.UsageError("--live knows --mesh, --fps, --codec, --quality, --segment, --reorder and --set alone")
    mesh, fps, codec = (options[name] for name in ("mesh", "fps", "codec"))
    report = encode_live(sources, target, mesh, fps, codec, parse_settings(options))
    out.json(asdict(report))
    out.text(f"{STDIN} ({report.frames} frames, {report.vertices} vertices) -> {target} ({_size(report.bytes)})")


def _print_report(out: Output, report: Report, name: str, target: str) -> None:
    """Print what an encode did, as text and notes."""
    from gvpipe.foundation import notes
    from gvpipe.rate_control.purposes import name_with

    for note in report.notes:
        out.note(note)
    shape = notes.shape(report.frames, report.vertices)
    size = f"{_size(report.bytes)}, {report.bpvf:.3f} bits per vertex and frame"
    out.text(f"{name} ({shape}) -> {target} ({size})")
    seconds = dict(report.seconds)
    stages = ", ".join(f"{name} {value:.1f}" for name, value in seconds.items() if name != "encode" and value >= 0.05)
    out.text(f"{seconds['encode']:.1f} s: {stages}")
    for tried in report.tried:
        keys = [key for key in ("bpvf", "rmse_diag", "kg", "max_diag") if tried[key] is not None]
        measures = ", ".join(f"{key} {tried[key]:.4g}" for key in keys)
        codec_name = name_with(tried["codec"], tried["settings"])
        out.text(f"  {codec_name} at quality {tried['quality']:.4g}: {tried['bytes']} bytes, {measures}")
    if report.reason:
        out.text(report.reason)
    _print_sections(out, report.sections, round(8 * report.bytes / report.bpvf))


@cli.command()
@click.argument("source", metavar="FILE.mp4")
@click.argument("target", metavar="OUTPUT")
@click.option("--start", type=int, help="First frame. [default: 0]")
@click.option("--stop", type=int, help="Frame after the last. [default: the end]")
@click.option("--frames", metavar="A:B", help="The same as --start A --stop B; either may be left out.")
@click.option("--fps", type=float, help="Frames per second of the output, instead of the file's.")
@click.option("--part", "parts", multiple=True, metavar="NAME", help="Write this part only; repeat for more.")
@click.option("--lod", type=int, default=0, show_default=True, help="Level of detail: 0 the mesh, higher is coarser.")
@click.option("--local", is_flag=True, help="Leave out the origin of a mesh far from the world's: float32 positions near 0.")
@click.option("--skin/--no-skin", default=None, help="Of a .glb or USD: a skeleton or none. [default: of a .glb if exact]")
@click.option("--audio-out", metavar="FILE", help="Where the sound goes: .m4a, .wav or none. [default: OUTPUT's name, .m4a]")
@compress_option
@click.option("--texture-out", metavar="FILE.mp4", help="Write the textures that move as videos, too, as they are coded.")
@unlimited_option
@output_options
def decode(
    source: str,
    target: str,
    start: int | None,
    stop: int | None,
    frames: str | None,
    fps: float | None,
    parts: tuple[str, ...],
    lod: int,
    local: bool,
    skin: bool | None,
    audio_out: str | None,
    compress: str,
    texture_out: str | None,
    unlimited: bool,
    out: Output,
) -> None:
    """Decode a geometry video.

    OUTPUT is an .npz, a scene (.glb, .usdc, .usda, .usdz, .abc), a point cache (.pc2, .mdd, .npy), .pvd, .vtkhdf, a
    folder of vertex animation textures (.openvat), or a pattern of frame files such as out/%04d.obj (also .ply, .stl, .off,
    .glb, .vtp), or - for an .npz on standard output. FILE - is a geometry video on standard input. The sound goes beside it.
    """
    from gvpipe import api
    from gvpipe.asset_coding.directory import UNFINISHED
    from gvpipe.cli.captures import write_shots
    from gvpipe.cli.choices import chosen, chosen_frames
    from gvpipe.cli.skeletons import check_glb_options, skin_of_video
    from gvpipe.foundation import notes
    from gvpipe.io.writing import takes_skin
    from gvpipe.media.sound_files import check_sound_target
    from gvpipe.playback import files
    from gvpipe.playback.texture_files import write_tracks

    out = out.carrying(target)
    check_glb_options(target, skin is True, compress)
    sound_target = sound_path(target, source, audio_out)
    if audio_out is not None and sound_target is not None:
        check_sound_target(sound_target)
    first, last = chosen_frames(start, stop, frames)
    with source_path(source) as given, target_path(target, ".npz") as path, out.progress() as progress:
        video = api.open_capture(given, unlimited=unlimited)
        (number, begin, end), *others = video.capture().spans(first, last)
        if others:
            asked = {"parts": parts, "compress": compress, "fps": fps, "lod": lod, "local": local, "skin": skin}
            beside = (sound_target, audio_out)
            write_shots(video.capture().part(first, last), source, target, path, first, asked, progress, out, beside)
            return
        player = video.shot(number)
        start, stop = video.starts[number] + begin, video.starts[number] + end
        level = player.level(lod)
        sequence = chosen(level.part(begin, end), parts, fps, "decode", progress)
        found, said = skin_of_video(player, path, (begin, end), skin, is_whole=not parts and not lod)
        tracks = write_tracks(player, texture_out) if texture_out else []
        silent = sequence.with_sound(None)
        noticed = [*said, *files.write(silent.local() if local else silent, path, start, found, compress)]
        sound, heard = write_beside(sequence.sound, sound_target, audio_out)
    noticed += heard + [note for note in player.bitstream.lost if note not in noticed]
    noticed += [notes.origin_left_out(player.origin.tolist())] if local and player.origin.any() else []
    noticed += level.notes if lod else ()
    noticed += [UNFINISHED] if player.bitstream.is_unfinished and UNFINISHED not in noticed else []
    for note in noticed:
        out.note(note)
    values = {"output": shown(target, STDOUT), "frames": stop - start, "start": start, "stop": stop, "fps": sequence.fps}
    values |= {"vertices": sequence.n_vertices, "triangles": len(sequence.faces), "lod": lod}
    values |= {"textures": tracks} if tracks else {}
    values |= {"joints": found.joints if found else 0} if takes_skin(str(target)) else {}
    values |= {"audio": {"output": sound_target, **sound.to_json()}} if sound else {}
    out.json({**values, "origin": [0.0, 0.0, 0.0] if local else player.origin.tolist(), "notes": noticed})
    shape = notes.shape(stop - start, sequence.n_vertices)
    out.text(f"{shown(source, STDIN)} -> {shown(target, STDOUT)} ({shape})")


@cli.command()
@click.argument("source", metavar="FILE.mp4")
@click.argument("target", metavar="OUTPUT.mp4")
@click.option("--layout", type=click.Choice(["stream", "plain"]), help="Of OUTPUT. [default: plain, unless FILE has it]")
@audio_options
@unlimited_option
@output_options
def restream(source: str, target: str, layout: str | None, unlimited: bool, out: Output, **options: Any) -> None:
    """Change the layout of a geometry video, without loss, to the one that plays over HTTP while it loads, or back.

    FILE may be an address (https://...), or - for standard input. OUTPUT - is standard output. With --audio or --no-audio
    the sound alone changes, unless --layout is given.
    """
    from gvpipe import api

    with source_path(source) as given, target_path(target, ".mp4") as path, out.progress():
        done = api.restream(given, path, layout, unlimited=unlimited, **parse_audio(options))
    out = out.carrying(target)
    for note in done.notes:
        out.note(note)
    out.json({"output": shown(target, STDOUT), **done.to_json()})
    sizes = f"{_size(done.bytes_before)} -> {_size(done.bytes)}"
    out.text(f"{shown(source, STDIN)} -> {shown(target, STDOUT)} ({done.layout} layout, {sizes})")


@cli.command()
@click.argument("folder", metavar="FOLDER")
@click.argument("target", metavar="SHARD-%05d.tar")
@click.option("--shard-size", metavar="BYTES", default="1GB", show_default=True, help="Most bytes of a shard: 500MB, 2GB.")
@click.option("--shard-count", type=click.IntRange(1), metavar="N", help="Most sequences of a shard.")
@click.option("--no-share", is_flag=True, help="Keep files as they are: store nothing once for files of one connectivity.")
@click.option("--card", metavar="README.md", help="Write a data-set card: counts, errors, settings; your own text in it stays.")
@unlimited_option
@output_options
def pack(
    folder: str,
    target: str,
    shard_size: str,
    shard_count: int | None,
    no_share: bool,
    card: str | None,
    unlimited: bool,
    out: Output,
) -> None:
    """Pack the geometry videos of a folder into shards for machine learning, in WebDataset's layout.

    A shard is a tar file. Each NAME.mp4 becomes NAME.mp4 and NAME.json in it, the latter with what is in NAME.json beside it,
    box, mean and scale of the positions, and errors that encode-all recorded.
    A shard stores once what several bare files have in common, such as triangles, where that saves 1 % of the bytes.
    """
    from gvpipe import datasets
    from gvpipe.cli.choices import parse_bytes
    from gvpipe.foundation.notes import count

    limit = parse_bytes("--shard-size", shard_size)
    with out.progress() as progress:
        packed = datasets.pack(
            folder,
            target,
            shard_bytes=limit,
            shard_sequences=shard_count,
            share=not no_share,
            card=card,
            progress=progress,
            unlimited=unlimited,
        )
    out.json(packed.to_json())
    for reason in packed.left_out.values():
        out.note(f"left out: {reason}")
    counts = f"{count(packed.sequences, 'sequence')}, {count(len(packed.shards), 'shard')}"
    shared = f", {count(packed.shared_sections, 'shared section')}" if packed.shared_sections else ""
    out.text(f"{folder} -> {target} ({counts}{shared}, {_size(packed.bytes)})")
    if packed.left_out:
        raise InputError(f"{len(packed.left_out)} files of {folder} are left out; {next(iter(packed.left_out.values()))}")


@cli.command()
@click.argument("source", metavar="SHARDS")
@click.argument("folder", metavar="FOLDER")
@click.argument("keys", metavar="[KEY...]", nargs=-1)
@unlimited_option
@output_options
def unpack(source: str, folder: str, keys: tuple[str, ...], unlimited: bool, out: Output) -> None:
    """Write samples of shards into FOLDER as whole files: KEY.mp4 and KEY.json.

    SHARDS is a tar file, or a glob in quotes ('shard-*.tar'). Without a KEY, all samples are written.
    """
    from gvpipe import datasets
    from gvpipe.foundation.notes import count

    with out.progress() as progress:
        try:
            done = datasets.unpack(source, folder, keys, progress=progress, unlimited=unlimited)
        except KeyError as exc:
            raise InputError(f"{source}: {exc.args[0]}") from exc
    out.json(done.to_json())
    out.text(f"{source} -> {folder} ({count(done.sequences, 'sequence')}, {_size(done.bytes)})")


@cli.command()
@click.argument("source", metavar="FILE")
@click.option("--clip", metavar="NAME", help="The animation to look at, of a file that has several. [default: the first]")
@click.option("--mesh", metavar="FILE", help="The triangles of a point cache (.pc2, .mdd, .npy).")
@click.option("--frames", metavar="A:B", help="Only frames A to B - 1 of the input; either may be left out.")
@click.option("--fps", type=float, help="Frames per second, instead of the input's; scenes are sampled at it.")
@unlimited_option
@output_options
def info(
    source: str,
    clip: str | None,
    mesh: str | None,
    frames: str | None,
    fps: float | None,
    unlimited: bool,
    out: Output,
) -> None:
    """Tell what a geometry video (- for standard input) holds and where its bytes go, or what is read of any other input.

    Of shards (shard.tar, 'shard-*.tar') it sums up the sequences, and checks each.
    """
    from gvpipe.cli.asset_lines import asset_lines, shape_lines, shot_line
    from gvpipe.cli.choices import parse_frames
    from gvpipe.playback import video_info

    if source.lower().endswith(".tar"):
        from gvpipe.cli.shards import show_shards

        if any(value is not None for value in (clip, mesh, frames, fps)):
            raise click.UsageError("--clip, --mesh, --frames and --fps are for sources; shards are summed up whole")
        show_shards(source, unlimited, out)
        return

    with source_path(source) as path, out.progress():
        if not is_video(path):
            reading = {"clip": clip, "mesh": mesh, "frames": parse_frames(frames), "unlimited": unlimited, "fps": fps}
            _source_info(source, path, reading, out)
            return
        if any(each is not None for each in (clip, mesh, frames, fps)):
            raise click.UsageError("--clip, --mesh, --frames and --fps are for sources; a geometry video is shown whole")
        found = video_info.info(path, unlimited=unlimited)
    out.json(found.to_json())
    layout = "" if found.layout == "plain" else f", {found.layout} layout"
    out.text(f"{shown(source, STDIN)}: {found.codec} version {found.version}{layout}")
    for line in shape_lines(found):
        out.text(line)
    if len(found.levels) > 1:
        out.text("levels of detail, vertices: " + ", ".join(f"{lod}: {count}" for lod, count in enumerate(found.levels)))
    for line in asset_lines(found):
        out.text(line)
    for note in found.notes:
        out.note(note)
    out.text(f"{_size(found.bytes)}, {found.bpvf:.3f} bits per vertex and frame:")
    for row in found.shots:
        out.text(shot_line(row))
    _print_sections(out, found.sections, round(8 * found.bytes / found.bpvf))


def _source_info(source: str, path: str, reading: dict[str, Any], out: Output) -> None:
    """Print what is read of an input that is no geometry video; ``reading`` are further arguments of `source_info`."""
    from gvpipe.cli.asset_lines import asset_lines, shape_lines, shot_line, time_lines
    from gvpipe.io.source_info import source_info

    found = source_info(path, **reading)
    out.json(found.to_json())
    out.text(shown(source, STDIN) + ("" if found.bytes is None else f": {_size(found.bytes)}"))
    for line in [*shape_lines(found), *asset_lines(found), *time_lines(found), *map(shot_line, found.shots)]:
        out.text(line)
    for note in found.notes:
        out.note(note)


@cli.command()
@click.argument("reference", metavar="REFERENCE")
@click.argument("distorted", metavar="DISTORTED")
@click.option("--clip", metavar="NAME", help="The animation of REFERENCE, of a file that has several. [default: the first]")
@click.option("--other-clip", metavar="NAME", help="The same of DISTORTED.")
@click.option("--mesh", metavar="FILE", help="The triangles of point caches (.pc2, .mdd, .npy), of either side.")
@click.option("--frames", metavar="A:B", help="Only frames A to B - 1, of DISTORTED too unless it holds just as many.")
@click.option("--fps", type=float, help="Frames per second at which REFERENCE is sampled.")
@click.option("--surface", is_flag=True, help="The distance of the surfaces, too. [default: where vertices do not correspond]")
@click.option("--metrics", metavar="NAME,...", default="", help="More metrics: psnr, dame, fmpd, mesh, d1, d2.")
@unlimited_option
@output_options
def compare(
    reference: str,
    distorted: str,
    clip: str | None,
    other_clip: str | None,
    mesh: str | None,
    frames: str | None,
    fps: float | None,
    surface: bool,
    metrics: str,
    unlimited: bool,
    out: Output,
) -> None:
    """Measure how far DISTORTED is from REFERENCE; both are sequences or geometry videos, one may be - for standard input.

    Where their vertices do not correspond, surfaces are compared: the distance of each from the other.
    """
    from gvpipe.cli.choices import parse_frames
    from gvpipe.metrics import comparison, frame_metrics
    from gvpipe.playback import files

    more = frame_metrics.check_metrics(metrics) if metrics else ()
    if reference == distorted == PIPE:
        raise click.UsageError("both are -, and there is one standard input", click.get_current_context())
    span = parse_frames(frames)
    its_mesh, other_mesh = _meshes((reference, distorted), mesh)
    with source_path(reference) as one, source_path(distorted) as other, out.progress() as progress:
        read_given = partial(files.read, one, fps, clip, its_mesh, span, unlimited=unlimited)
        read_other = partial(files.read, other, None, other_clip, other_mesh, unlimited=unlimited)

        def show_progress(done: int, of: int) -> None:
            if progress:
                progress("compare", done / of)

        try:
            given = read_given()
            compared = read_other() if span is None else _same_frames(read_other, span, len(given))
            if (given.volume is None) != (compared.volume is None):  # of one, what lies inside was not read
                read_other = partial(read_other, volume=True)
                given = given if given.volume is not None else read_given(volume=True)
                compared = read_other() if span is None else _same_frames(read_other, span, len(given))
            result = comparison.compare(given, compared, show_progress, surface=surface or None, metrics=more)
        except TopologyChange:
            capture = files.read_capture(one, fps, clip, its_mesh, span, unlimited=unlimited)
            whole = files.read_capture(other, None, other_clip, other_mesh, unlimited=unlimited)
            part = whole if span is None or len(whole) == len(capture) else whole.part(*span)
            result = comparison.compare_captures(capture, part, show_progress, metrics=more)
    values = result.to_json()
    out.json(values)
    if result.unpaired:
        out.note(f"surfaces alone are compared: {result.unpaired}")
    else:
        _print_numbers(out, {name: value for name, value in values.items() if name != "surface"})
    if result.surface is not None:
        _print_numbers(out, result.surface.to_json(), "surface ")
    for name, metric in result.metrics.items():
        out.text(f"{name:<14} {_metric_text(metric)}")
    for kind, errors in (("attribute", result.attributes), ("field", result.fields), ("inside", result.volume)):
        for name, error in errors.items():
            largest, mean = error["max"], error["mean"]
            measured = "one side lacks it" if largest is None else f"largest error {largest:.4g}, mean {mean:.4g}"
            out.text(f"{kind} {name}: {measured}")
    for name, ratios in result.textures.items():
        out.text(f"texture {name}: {_texture_text(ratios)}")


def _texture_text(ratios: TextureErrors) -> str:
    """A texture's mean over frames, and the least of these."""
    if ratios.rgb_psnr is None:
        return "one side lacks it, or it cannot be decoded"
    parts = (("RGB", ratios.rgb_psnr, ratios.rgb_psnr_worst), ("luma", ratios.luma_psnr, ratios.luma_psnr_worst))
    return ", ".join(f"{name} {mean:.2f} dB (worst {worst:.2f})" for name, mean, worst in parts)


def _metric_text(metric: FrameMetric) -> str:
    """A metric's mean over frames, and the range of these."""
    known = [each for each in metric.frames if each is not None]
    if metric.value is None or not known:
        return "not defined"
    return f"{metric.value:.6g} (frames: {min(known):.6g} to {max(known):.6g})"


def _print_numbers(out: Output, values: dict[str, Any], prefix: str = "") -> None:
    """A line for each number, by its name."""
    for name, value in values.items():
        if value is None or isinstance(value, int | float):
            out.text(f"{prefix + name:<{14 + len(prefix)}} {'not defined' if value is None else format(value, '.6g')}")


def _meshes(paths: tuple[str, str], mesh: str | None) -> list[str | None]:
    """The mesh of either side: that of sides that are point caches; raises `click.UsageError` if none is."""
    from gvpipe.io.scene_formats import POINT_CACHES

    needs = [path.lower().endswith(POINT_CACHES) for path in paths]
    if mesh is not None and not any(needs):
        raise click.UsageError(f"--mesh is for {', '.join(POINT_CACHES)}; neither side is one", click.get_current_context())
    return [mesh if need else None for need in needs]


def _same_frames(read: Callable[..., MeshSequence], span: tuple[int, int | None], count: int) -> MeshSequence:
    """What `read` returns if it has ``count`` frames, else a span of it."""
    try:
        whole = read()
    except TopologyChange:  # not in the span, maybe
        return read(frames=span)
    return whole if len(whole) == count else read(frames=span)


cli.add_command(convert)
cli.add_command(encode_all)
cli.add_command(bench)
cli.add_command(reproduce)
cli.add_command(fetch_data)
cli.add_command(plot)
cli.add_command(codecs)
cli.add_command(new_codec)


@cli.command("export-html")
@click.argument("sources", metavar="FILE.mp4...", nargs=-1, required=True)
@click.argument("target", metavar="OUT.html")
@click.option("--up", type=click.Choice(["y", "z"]), help="The axis that stands upright. [default: the file's own, else y]")
@click.option("--convert", is_flag=True, help="Encode the file anew, in the profile that all browsers play.")
@click.option("--quality", type=float, help="0-100, of a conversion: the error that it may add. [default: 90]")
@page_options
@unlimited_option
@output_options
def export_html(
    sources: tuple[str, ...], target: str, up: str | None, quality: float | None, out: Output, **options: Any
) -> None:
    """Write a web page of one file that plays a geometry video, without a network.

    The page holds the file as it is. 10-bit pictures (profile precise) play in Chromium alone; --convert makes a page for all
    browsers, as is done for files that no browser reads. That adds an error that is told: KG 0.044 or less by default.

    Several files, such as the pieces of --split, play one after the other.
    """
    from gvpipe import web

    source, *then = sources
    with source_path(source) as path, out.progress() as progress:
        report = web.export_html(path, target, up, quality, progress, then=then, **options)
    out.json(report.to_json())
    size = f"{_size(report.bytes)}, {_size(report.video_bytes)} of which are the geometry video"
    out.text(f"{shown(source, STDIN)} -> {target} ({size})")
    _tell_conversion(out, report)


@cli.command()
@click.argument("source", metavar="FILE.mp4")
@click.option("--up", type=click.Choice(["y", "z"]), help="The axis that stands upright. [default: the file's own, else y]")
@page_options
@unlimited_option
@output_options
def play(source: str, up: str | None, out: Output, **options: Any) -> None:
    """Play a geometry video in your browser.

    Where no browser can be opened, the page's path is printed. The page is one file and needs no network. Pages that are older
    than a day are removed by the next `gvpipe play`.
    """
    from pathlib import Path

    from gvpipe import web
    from gvpipe.foundation.atomic import lasting_folder
    from gvpipe.web.browser import open_page

    with source_path(source) as path, lasting_folder() as folder, out.progress() as progress:
        page = Path(folder) / f"{Path(path).stem}.html"  # stays: the browser reads it later
        report = web.export_html(path, page, up, None, progress, **options)
    _tell_conversion(out, report)
    is_open = open_page(page)
    if not is_open:
        out.note("no browser can be opened here; open the page that is printed in one, here or on another computer")
    out.json({"page": str(page), "opened": is_open, **report.to_json()})
    out.text(f"{shown(source, STDIN)} plays in your browser" if is_open else page)


@cli.command()
@click.argument("source", metavar="FILE.mp4|SEQUENCE")
@click.argument("target", metavar="OUT.png|.gif|.mp4")
@click.option("--frame", type=int, help="Only this frame; negative counts from the end. [default: 0 for .png, else all]")
@click.option("--size", default="512", show_default=True, metavar="N|WxH", help="Pixels.")
@click.option(
    "--view", default="three-quarter", show_default=True, help="front, back, left, right, top, bottom or AZIMUTH,ELEVATION."
)
@click.option("--up", type=click.Choice(["x", "y", "z"]), help="The axis that is up. [default: the input's own, else y]")
@click.option("--turntable", is_flag=True, help="Let the camera go once around.")
@click.option("--follow", is_flag=True, help="Let the camera go with the mesh.")
@click.option("--error-of", "error_of", metavar="REFERENCE", help="Colour each vertex by its distance from REFERENCE's.")
@click.option("--error-max", type=float, metavar="PERCENT", help="Where the colours end. [default: the largest error drawn]")
@click.option("--shading", type=click.Choice(["smooth", "flat"]), default="smooth", show_default=True)
@click.option("--field", metavar="NAME", help="Colour by a field's values; vectors by their length.")
@click.option("--colormap", metavar="NAME", help="viridis, magma, coolwarm, gray or errors. [default: viridis]")
@click.option(
    "--range",
    "limits",
    metavar="A,B",
    help="Ends of the colours, percentiles (2%,98%) or symmetric. [default: the range drawn]",
)
@click.option("--log", is_flag=True, help="Let colours follow the field's logarithm; what is not above 0 is grey.")
@click.option("--part", "parts", multiple=True, metavar="NAME", help="Paint this part only; repeat for more.")
@click.option("--plain", "--no-textures", "plain", is_flag=True, help="Leave out materials, textures and colours.")
@click.option(
    "--clip",
    metavar="NAME|x=0.3",
    help="The animation to paint, of a file that has several [default: the first]. Or a plane: x=0.3, y=30% of the box; "
    "what lies above is left out, below of -x=0.3. The cut of a volume is filled.",
)
@click.option("--mesh", metavar="FILE", help="The triangles of a point cache (.pc2, .mdd, .npy).")
@click.option("--frames", metavar="A:B", help="Only frames A to B - 1 of the input; either may be left out.")
@click.option("--fps", type=float, help="Frames per second, instead of the input's; scenes are sampled at it.")
@unlimited_option
@output_options
def render(source: str, target: str, size: str, limits: str | None, frames: str | None, out: Output, **options: Any) -> None:
    """Paint a geometry video or a sequence as a picture or a film; needs no display and no GPU."""
    from gvpipe import api
    from gvpipe.cli.choices import parse_frames
    from gvpipe.rendering.cut import is_cut
    from gvpipe.rendering.field_range import parse_range
    from gvpipe.rendering.films import parse_size

    if options["error_max"] is not None and not options["error_of"]:
        raise click.UsageError("--error-max ends the colours of errors; give --error-of too", click.get_current_context())
    pixels = parse_size(size)
    options |= {"frames": parse_frames(frames), "field_range": None if limits is None else parse_range(limits)}
    if is_cut(options["clip"]):
        options |= {"cut": options["clip"], "clip": None}
    with source_path(source) as path, out.progress() as progress:
        notes = api.render(path, target, size=pixels, progress=progress, **options)
    for note in notes:
        out.note(note)
    n_bytes = os.path.getsize(target)
    out.json({"output": target, "width": pixels[0], "height": pixels[1], "bytes": n_bytes, "notes": notes})
    out.text(f"{shown(source, STDIN)} -> {target} ({pixels[0]}x{pixels[1]}, {_size(n_bytes)})")


@cli.command()
@click.option("--installed", is_flag=True, help="Keep the machine code in the installation, for all its users.")
@click.option("--portable", is_flag=True, help="With --installed: for most processors of this kind, not for this one.")
@output_options
def warmup(installed: bool, portable: bool, out: Output) -> None:
    """Compile what commands need, so that the first ones do not wait: for images and installations of many users."""
    import dataclasses

    from gvpipe.cli.warmup import warm_up

    with out.progress() as progress:
        found = warm_up(installed, portable, progress)
    out.json(dataclasses.asdict(found))
    out.text(
        f"{found.folder}: {found.files} files of machine code, {found.new} new, {_size(found.size)}; {found.seconds:.1f} s"
    )


def _tell_conversion(out: Output, report: ExportReport) -> None:
    """Say on standard error what the page shows instead of the file's own frames, or of those that come later."""
    if report.unfinished:
        out.note("the file is still written: the page has the frames that are there by now")
    if report.converted:
        values = (report.rmse_diag, report.max_diag, report.kg)
        rmse, largest, kg = ("not defined" if v is None else f"{v:.1e}" for v in values)
        out.note(
            f"the page holds a conversion of {report.converted} to mcgv, web profile, which adds an "
            f"error of rmse {rmse}, at most {largest}, of the diagonal (KG {kg} %)"
        )


def _print_sections(out: Output, sections: dict[str, int], n_samples: int) -> None:
    from rich.console import Console

    from gvpipe.cli.breakdown import section_table

    console = Console(file=sys.stdout, width=100, color_system=None)
    with console.capture() as captured:
        console.print(section_table(sections, n_samples))
    text = "\n".join(line.rstrip() for line in captured.get().splitlines())
    encoding = sys.stdout.encoding or "utf-8"
    out.text(text.encode(encoding, "replace").decode(encoding))


def _size(count: int) -> str:
    return f"{count / 1e6:.2f} MB" if count >= 1e6 else f"{count / 1e3:.1f} kB"


def _left(exc: BaseException) -> str:
    """What an end in the middle leaves, which a command may have noted."""
    return "; ".join(getattr(exc, "__notes__", ())) or "no file is left half written"


def _one_line(exc: Exception) -> str:
    return " ".join(str(exc).split())


def _fail(message: str, status: int) -> int:
    click.echo(f"Error: {message}", err=True)
    return status
