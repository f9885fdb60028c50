"""What `gvpipe info` prints of a mesh and its asset: a line for each kind of thing."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gvpipe.io.source_info import SourceInfo
    from gvpipe.playback.video_info import Info

MOST = 12  # names in a line
SOON = 0.001  # seconds


def shape_lines(info: Info | SourceInfo) -> Iterator[str]:
    """Yield the numbers of vertices, triangles and frames, and where frame 0 lies."""
    from gvpipe.foundation.notes import count, show_origin

    low, high = info.bounding_box["min"], info.bounding_box["max"]
    place = f", relative to {show_origin(info.origin)}" if any(info.origin) else ""
    vertices, triangles = count(info.vertices, "vertex", "vertices"), count(info.triangles, "triangle")
    yield f"{vertices}, {triangles}, {count(info.frames, 'frame')} at {info.fps:g} fps"
    yield "frame 0 lies in " + " x ".join(f"{a:g}..{b:g}" for a, b in zip(low, high, strict=True)) + place


def shot_line(row: dict[str, Any]) -> str:
    """What a shot of a capture is, of a row of `Info.shots` or `SourceInfo.shots`."""
    from gvpipe.foundation.notes import count

    span = f"frames {row['start']}:{row['start'] + row['frames']}"
    size = f"{count(row['vertices'], 'vertex', 'vertices')}, {count(row['triangles'], 'triangle')}"
    coded = f", {row['codec']}, {row['bytes']} bytes" if "codec" in row else ""
    return f"shot of {span}: {size}{coded}"


def asset_lines(info: Info | SourceInfo) -> Iterator[str]:
    """Yield the lines; none for a file of positions and triangles alone."""
    if info.parts:
        yield f"parts: {_names([part['name'] for part in info.parts])}"
    if info.polygons:
        yield "polygons: " + ", ".join(f"{count} of {corners} corners" for corners, count in info.polygons.items())
    for kind, listed in (("attribute", info.attributes), ("field", info.fields)):
        for each in listed:
            yield f"{kind} {_described(each)}"
    if info.materials:
        yield f"materials: {_names(info.materials)}"
    for image in info.images:
        size = "x".join(map(str, image["size"])) if image["size"] else "size unknown"
        kind = f"{image['frames']} pictures, {image['codec'] or 'files'}" if "frames" in image else image["media_type"]
        yield f"image {image['name']}: {kind}, {size}" + (f", {image['bytes']} bytes" if image["bytes"] else "")
    if (volume := getattr(info, "volume", None)) is not None:
        names = ", ".join([*volume["point_fields"], *volume["cell_fields"]]) or "no numbers"
        yield f"volume: {volume['cells']} cells, {volume['points']} inner points, {names}, {volume['bytes']} bytes"
    if (audio := getattr(info, "audio", None)) is not None:
        channels = f"{audio['channels']} channel" + ("s" if audio["channels"] != 1 else "")
        start = f" from second {audio['start']:.4g} on" if audio["start"] >= SOON else ""
        size = f"{audio['bytes']} bytes"
        yield f"sound: {audio['codec']}, {channels}, {audio['rate']} Hz, {audio['seconds']:.4g} s{start}, {size}"
    about = dict(info.metadata)
    times, texts = about.pop("times"), about.pop("texts")
    said = {key: value for key, value in about.items() if value} | texts
    if times:
        yield f"times: {times[0]:.9g}..{times[-1]:.9g} s, one for each frame"
    if said:
        yield "metadata: " + ", ".join(f"{key} {value}" for key, value in said.items())


def time_lines(info: SourceInfo) -> Iterator[str]:
    """Yield the seconds from the first frame to the last, and the clips with theirs."""
    if info.frames > 1:
        yield f"time: {info.time_range[0]:g}..{info.time_range[1]:g} s"
    if info.clips:
        spans = zip(info.clips, info.clip_ranges, strict=True)
        yield "clips: " + ", ".join(f"{name} ({start:g}..{stop:g} s)" for name, (start, stop) in spans)


def _described(each: dict[str, Any]) -> str:
    unit = f" {each['unit']}" if each["unit"] else ""
    span = f", {each['range'][0]:g}..{each['range'][1]:g}{unit}" if each.get("range") else ""
    measure = " degrees" if each["kind"] in ("normal", "tangent") else unit
    shape = f"{each['components']} x {each['type']} per {each['domain']}"
    text = f"{each['name']}: {each['kind']}, {shape}{span}"
    if "bound" not in each:  # of a source
        return text
    bound = f"within {each['bound']:.4g}{measure}" if each["bound"] else "exact"
    return f"{text}, {bound}, {each['bytes']} bytes"


def _names(names: list[str]) -> str:
    shown = ", ".join(name or "(no name)" for name in names[:MOST])
    return f"{len(names)}: {shown}" + (", ..." if len(names) > MOST else "")
