"""Animated triangle meshes as small MP4 geometry videos.

Examples:
    >>> import gvpipe
    >>> report = gvpipe.encode("samples/creature.npz", "creature.mp4")  # doctest: +SKIP
    >>> with gvpipe.open("creature.mp4") as video:  # doctest: +SKIP
    ...     positions = video[10]  # (V, 3) float32

Everything named in ``__all__`` loads on first use, so that importing gvpipe costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from gvpipe.foundation.version import __version__ as __version__

if TYPE_CHECKING:
    from gvpipe.api import Restreamed, compare, decode, encode, open, open_capture, render, restream, skin
    from gvpipe.asset.attribute import Attribute
    from gvpipe.asset.field import Field
    from gvpipe.asset.material import Image, Material, Texture
    from gvpipe.asset.metadata import Metadata
    from gvpipe.asset.part import Part
    from gvpipe.batch.runs import BatchReport, encode_all
    from gvpipe.captures.files import write
    from gvpipe.encoding.report import Report
    from gvpipe.foundation.errors import GvpipeError
    from gvpipe.grids.cells import Cells
    from gvpipe.grids.volume import Volume
    from gvpipe.io.simulation.vtk_frames import to_pyvista, to_vtk
    from gvpipe.io.simulation.vtk_objects import from_pyvista, from_vtk
    from gvpipe.io.trimesh_objects import to_trimesh
    from gvpipe.media.sound import Sound
    from gvpipe.media.sound_files import read_sound
    from gvpipe.metrics.comparison import Comparison
    from gvpipe.model.capture import Capture
    from gvpipe.model.sequence import MeshSequence
    from gvpipe.model.skin import Skin
    from gvpipe.notebook import show
    from gvpipe.playback.capture_player import CapturePlayer
    from gvpipe.playback.files import read, read_capture
    from gvpipe.playback.live import LiveEncoder, open_live
    from gvpipe.playback.player import Player
    from gvpipe.playback.video_info import Info, info
    from gvpipe.rasterizer.camera import Camera
    from gvpipe.rasterizer.renderer import Renderer
    from gvpipe.recording import Recorder, RigidParts, record
    from gvpipe.web import ExportReport, export_html

__all__ = [
    "Attribute",
    "BatchReport",
    "Camera",
    "Capture",
    "CapturePlayer",
    "Cells",
    "Comparison",
    "ExportReport",
    "Field",
    "GvpipeError",
    "Image",
    "Info",
    "LiveEncoder",
    "Material",
    "MeshSequence",
    "Metadata",
    "Part",
    "Player",
    "Recorder",
    "Renderer",
    "Report",
    "Restreamed",
    "RigidParts",
    "Skin",
    "Sound",
    "Texture",
    "Volume",
    "compare",
    "decode",
    "encode",
    "encode_all",
    "export_html",
    "from_pyvista",
    "from_vtk",
    "info",
    "open",
    "open_capture",
    "open_live",
    "read",
    "read_capture",
    "read_sound",
    "record",
    "render",
    "restream",
    "show",
    "skin",
    "to_pyvista",
    "to_trimesh",
    "to_vtk",
    "write",
]

_HOMES = {
    "gvpipe.encoding.report": ("Report",),
    "gvpipe.api": ("Restreamed", "compare", "decode", "encode", "open", "open_capture", "render", "restream", "skin"),
    "gvpipe.asset.attribute": ("Attribute",),
    "gvpipe.asset.field": ("Field",),
    "gvpipe.asset.material": ("Image", "Material", "Texture"),
    "gvpipe.asset.metadata": ("Metadata",),
    "gvpipe.grids.cells": ("Cells",),
    "gvpipe.grids.volume": ("Volume",),
    "gvpipe.asset.part": ("Part",),
    "gvpipe.batch.runs": ("BatchReport", "encode_all"),
    "gvpipe.foundation.errors": ("GvpipeError",),
    "gvpipe.io.simulation.vtk_objects": ("from_pyvista", "from_vtk"),
    "gvpipe.io.simulation.vtk_frames": ("to_pyvista", "to_vtk"),
    "gvpipe.io.trimesh_objects": ("to_trimesh",),
    "gvpipe.notebook": ("show",),
    "gvpipe.playback.capture_player": ("CapturePlayer",),
    "gvpipe.captures.files": ("write",),
    "gvpipe.playback.files": ("read", "read_capture"),
    "gvpipe.playback.live": ("LiveEncoder", "open_live"),
    "gvpipe.media.sound": ("Sound",),
    "gvpipe.media.sound_files": ("read_sound",),
    "gvpipe.metrics.comparison": ("Comparison",),
    "gvpipe.playback.player": ("Player",),
    "gvpipe.rasterizer.camera": ("Camera",),
    "gvpipe.rasterizer.renderer": ("Renderer",),
    "gvpipe.model.capture": ("Capture",),
    "gvpipe.model.sequence": ("MeshSequence",),
    "gvpipe.model.skin": ("Skin",),
    "gvpipe.recording": ("Recorder", "RigidParts", "record"),
    "gvpipe.playback.video_info": ("Info", "info"),
    "gvpipe.web": ("ExportReport", "export_html"),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name == "datasets":  # a package of its own functions
        return import_module("gvpipe.datasets")
    if name not in _HOME:
        raise AttributeError(f"module 'gvpipe' has no attribute {name!r}")
    return getattr(import_module(_HOME[name]), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
