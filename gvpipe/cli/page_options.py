"""The options of the commands that write a page: how it opens."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from gvpipe.cli.console import warp_option

Command = Callable[..., None]

OPTIONS: tuple[Callable[[Command], Command], ...] = (
    click.option("--field", metavar="NAME", help="Colour by a field's values; vectors by their length."),
    click.option("--colormap", metavar="NAME", help="viridis, magma, coolwarm or gray. [default: viridis]"),
    click.option(
        "--range",
        "field_range",
        metavar="A,B",
        help="Ends of the colours, percentiles (2%,98%) or symmetric. [default: the field's range]",
    ),
    click.option("--log", is_flag=True, help="Let colours follow the field's logarithm; what is not above 0 is grey."),
    click.option("--speed", type=float, default=1.0, show_default=True, help="0.0625 to 16; 1 is the video's own."),
    warp_option,
    click.option(
        "--clip",
        metavar="PLANE",
        help="Cut by a plane: x=0.3, y=30% (of the box), or -x=0.3 (what lies below is left out).",
    ),
    click.option("--camera", metavar="VIEW", help="front, back, left, right, top, bottom, three-quarter or AZIMUTH,ELEVATION."),
    click.option("--shading", type=click.Choice(["smooth", "flat"]), default="smooth", show_default=True),
)


def page_options(command: Any) -> Any:
    """Give a command the options of a page: keywords of `gvpipe.export_html`."""
    for option in reversed(OPTIONS):
        command = option(command)
    return command
