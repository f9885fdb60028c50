"""The options of every command that encodes, and what they ask for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from gvpipe.cli.console import real_time_option, unlimited_option, volume_option, warp_option

if TYPE_CHECKING:
    from gvpipe.coding.codec import Codec

Command = Callable[..., None]

TARGETS = ("target_rmse", "target_kg", "target_bpvf", "max_error")
OPTIONS = (
    click.option(
        "--codec",
        help="See `gvpipe codecs`; auto: the one with the smallest file. [default: mcgv, of captures pca; with --for, auto]",
    ),
    click.option(
        "--for",
        "purpose",
        type=click.Choice(["web", "archive", "stream"]),
        help="What the file is for: browsers play it; the smallest; starts at once and jumps fast. [default: archive]",
    ),
    click.option(
        "--quality",
        type=float,
        help="0-100, higher is better; with --target-bpvf and --max-error, where the search begins. [default: 75]",
    ),
    click.option("--target-rmse", type=float, metavar="X", help="Largest rmse, as a part of the diagonal, such as 1e-4."),
    click.option("--target-kg", type=float, metavar="X", help="Largest KG error, percent, such as 0.1."),
    click.option("--target-bpvf", type=float, metavar="X", help="Most bits per vertex and frame."),
    click.option("--max-error", metavar="E", help="Bound for every vertex: model units, or 0.05% of the diagonal."),
    click.option("--set", "pairs", multiple=True, metavar="KEY=VALUE", help="A setting of the codec; repeat for more."),
    click.option("--segment", type=int, help="Most frames per segment. [default: 500]"),
    click.option("--memory", metavar="BYTES", help="Take about so much memory, by shorter segments: 2GB. Not for codec mcgv."),
    click.option("--fps", type=float, help="Frames per second, instead of the input's."),
    click.option("--reorder", is_flag=True, help="Let the codec choose the vertex order: smaller."),
    click.option(
        "--attribute",
        "attributes",
        multiple=True,
        metavar="NAME=BOUND",
        help="Largest error of an attribute: a number (degrees for normals), 0.1% of its range, exact or none; "
        "repeat for more.",
    ),
    click.option(
        "--field",
        "fields",
        multiple=True,
        metavar="NAME=BOUND",
        help="The same for an animated field; 0.1%,nan=keep keeps NaN as holes, "
        "1%,by=length bounds the length of a vector's error.",
    ),
    click.option("--clip", metavar="NAME", help="The animation to read, of a file that has several. [default: the first]"),
    click.option("--mesh", metavar="FILE", help="The triangles of a point cache (.pc2, .mdd, .npy)."),
    click.option("--frames", metavar="A:B", help="Only frames A to B - 1 of the input; either may be left out."),
    real_time_option,
    warp_option,
    volume_option,
    click.option(
        "--track",
        is_flag=False,
        flag_value="on",
        type=click.Choice(["on", "off"]),
        help="Let one mesh follow the surface where frames have meshes of their own. [default: if most have]",
    ),
    click.option("--vertices", type=int, metavar="N", help="Of each mesh that follows. [default: as few as will do]"),
    click.option("--textures", metavar="N|FORMAT", help="Largest side of images, webp, jpeg or png, or both: 1024,webp."),
    click.option("--texture-quality", type=float, help="0-100, of textures with a picture for each frame. [default: 75]"),
    click.option(
        "--texture-codec",
        type=click.Choice(["h264", "hevc", "av1", "copy"]),
        help="Of these; copy: a video as it is. All browsers play h264. [default: copy for a video of H.264, else h264]",
    ),
    click.option(
        "--stream",
        is_flag=True,
        help="Write the stream layout: it plays over HTTP while it loads. --for stream chooses a codec that suits.",
    ),
    click.option(
        "--bare", is_flag=True, help="Write the bare layout, for data sets: no poster, nothing that only players need."
    ),
    unlimited_option,
)


@dataclass(frozen=True)
class Encoding:
    """What the options ask for.

    Args:
        codec: settings, or those of all codecs to choose from; None: the default, whose settings are in ``making``.
        reading: keywords of `gvpipe.playback.files.read`, but for ``unlimited``.
        making: keywords of `gvpipe.api.encode` for what is made of it.
        unlimited: as for `gvpipe.playback.files.read`.
    """

    codec: Codec | list[Codec] | None
    reading: dict[str, Any]
    making: dict[str, Any]
    unlimited: bool

    @property
    def keywords(self) -> dict[str, Any]:
        """Keywords for `gvpipe.api.encode`, all but the codec."""
        return {**self.reading, **self.making, "unlimited": self.unlimited}


def encode_options(command: Command) -> Command:
    """Give a command the options, as keywords that `parse_encoding` takes."""
    for option in reversed(OPTIONS):
        command = option(command)
    return command


def parse_encoding(options: dict[str, Any]) -> Encoding:
    """Return what the options ask for.

    Raises:
        click.UsageError: options that do not go together, or that are not of their form.
        SettingError: no such codec or setting, or a value out of its range.
    """
    from gvpipe.cli.choices import parse_bytes, parse_frames
    from gvpipe.coding.codec import Codec
    from gvpipe.coding.registry import codec_class
    from gvpipe.rate_control.purposes import candidates

    targets = {name: options[name] for name in TARGETS}
    if sum(value is not None for value in targets.values()) > 1:
        raise click.UsageError("give one of --target-rmse, --target-kg, --target-bpvf and --max-error")
    settings = parse_settings(options)
    codec: Codec | list[Codec] | None = candidates(
        options["codec"],
        options["purpose"],
        lambda name, own: codec_class(name).from_texts({**{key: str(value) for key, value in own.items()}, **settings}),
        frozenset(settings),
    )
    reading = {name: options[name] for name in ("fps", "clip", "mesh", "real_time", "warp", "volume")} | {
        "frames": parse_frames(options["frames"])
    }
    making = {}
    if isinstance(codec, Codec) and options["codec"] is None:  # which one is the default depends on the input
        codec, making = None, {name: getattr(codec, name) for name in settings}
    making |= {"track": None if options["track"] is None else options["track"] == "on", "vertices": options["vertices"]}
    making |= {**targets, "textures": options["textures"], "stream": options["stream"], "bare": options["bare"]}
    making |= {name: options[name] for name in ("texture_quality", "texture_codec")}
    making["memory"] = None if options["memory"] is None else parse_bytes("--memory", options["memory"])
    making["attributes"] = _parse_bounds("--attribute", options["attributes"])
    making["fields"] = _parse_bounds("--field", options["fields"])
    return Encoding(codec, reading, making, options["unlimited"])


def parse_settings(options: dict[str, Any]) -> dict[str, str]:
    """Settings of the codec that are given, by name; raises `click.UsageError`."""
    settings = parse_pairs(options["pairs"])
    if options["quality"] is not None and "quality" in settings:
        raise click.UsageError("give --quality or --set quality=, not both")
    plain = {"quality": options["quality"], "segment": options["segment"], "reorder": options["reorder"] or None}
    return settings | {key: str(value) for key, value in plain.items() if value is not None}


def parse_pairs(pairs: tuple[str, ...]) -> dict[str, str]:
    """``KEY=VALUE`` texts by key; raises `click.UsageError`."""
    settings = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not equals:
            raise click.UsageError(f"--set {pair}: KEY=VALUE is needed, such as --set clusters=30")
        settings[key.strip()] = value.strip()
    return settings


def _parse_bounds(option: str, texts: tuple[str, ...]) -> dict[str, str]:
    bounds = {}
    for text in texts:
        name, equals, bound = text.partition("=")
        if not (name and equals and bound):
            raise click.UsageError(f"{option} {text}: NAME=BOUND is needed, such as {option} {name or 'uv'}=0.1%")
        bounds[name] = bound
    return bounds
