"""Meshes that follow the timeline: the frame of a file is decoded when the scene comes to it.

A mesh keeps the path of its file (relative to the .blend, where that is saved), the scene's frame at which it starts, and what
of the file it shows. So saving, loading, undo and rendering need nothing else. A mesh whose file is missing stays as it is.
"""

import math
import os
from typing import Any

import bpy
from bpy.app.handlers import persistent

from . import meshes
from .sources import close_all, opened

SHOT = "geometry_video_shot"  # property of a mesh: the shot whose polygons it has
UP_AXES = (
    ("AUTO", "As the File Says", "Y up where the file says nothing"),
    ("X", "X Up", ""),
    ("Y", "Y Up", ""),
    ("Z", "Z Up", ""),
)

problems: dict[str, str] = {}  # by name of a mesh: why it does not follow
_rebased: dict[str, str] = {}  # by name of a mesh: the absolute path of its file, while a .blend is saved


def _changed(settings: Any, context: Any) -> None:
    mesh = settings.id_data
    if context is not None and mesh.name not in _rebased and settings.filepath and not mesh.is_editmode:
        follow_mesh(mesh, context.scene.frame_current)


# of newer versions, which warn of a relative path without it; 4.2 does not know it
KNOWN = bpy.types.Property.bl_rna.properties.keys()
RELATIVE = {"PATH_SUPPORTS_BLEND_RELATIVE"} if "is_path_supports_blend_relative" in KNOWN else set()


class GeometryVideo(bpy.types.PropertyGroup):
    """What a mesh follows; `Mesh.geometry_video`."""

    filepath: bpy.props.StringProperty(
        name="File",
        description="Geometry video, or frames, that the mesh follows",
        subtype="FILE_PATH",
        options=RELATIVE,
        update=_changed,
    )
    start: bpy.props.FloatProperty(name="Start", description="The scene's frame that shows frame 0", default=1, update=_changed)
    speed: bpy.props.FloatProperty(
        name="Speed",
        description="Frames of the file for each frame of the scene",
        default=1,
        min=0.001,
        max=1000,
        update=_changed,
    )
    repeat: bpy.props.BoolProperty(name="Repeat", description="Start again at the end", update=_changed)
    fields: bpy.props.BoolProperty(
        name="Fields", description="Decode animated numbers to attributes, too", default=True, update=_changed
    )
    up: bpy.props.EnumProperty(name="Up", items=UP_AXES, update=_changed)
    scale: bpy.props.FloatProperty(name="Scale", description="Size of the file's unit", default=1, precision=6, update=_changed)
    parts: bpy.props.StringProperty(description="Numbers of the file's parts that the mesh has; empty: all")


class DATA_PT_geometry_video(bpy.types.Panel):
    """Settings of a mesh that follows a file, beside its other data."""

    bl_label = "Geometry Video"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.mesh is not None

    def draw(self, context: Any) -> None:
        settings, layout = context.mesh.geometry_video, self.layout
        layout.use_property_split = True
        layout.prop(settings, "filepath")
        if context.mesh.name in problems:
            layout.label(text=problems[context.mesh.name], icon="ERROR")
        for name in ("start", "speed", "repeat", "fields", "up", "scale"):
            layout.prop(settings, name)
        layout.operator("object.geometry_video_bake", icon="ACTION")


def absolute(mesh: Any) -> str:
    """The path of a mesh's file, absolute."""
    return os.path.abspath(bpy.path.abspath(mesh.geometry_video.filepath, library=mesh.library))


def chosen_parts(mesh: Any) -> tuple[int, ...]:
    """Numbers of the parts that a mesh shows; none: all."""
    return tuple(int(each) for each in mesh.geometry_video.parts.split(",") if each)


def file_frame(settings: Any, n_frames: int, scene_frame: int) -> int:
    """The frame of the file that belongs to one of the scene: the first before the start, the last after the end."""
    number = math.floor((scene_frame - settings.start) * settings.speed + 1e-4)
    return number % n_frames if settings.repeat else min(max(number, 0), n_frames - 1)


def axis_of(settings: Any) -> str:
    """The up axis that a mesh's settings name; empty: the file's."""
    return "" if settings.up == "AUTO" else settings.up.lower()


def follow_mesh(mesh: Any, scene_frame: int) -> bool:
    """Show what belongs to a frame of the scene; False, with a message in `problems`, where that cannot be."""
    settings = mesh.geometry_video
    try:
        path = absolute(mesh)
        source = opened(path)
        number = file_frame(settings, len(source), scene_frame)
        shot, own, positions = source.positions(number)
        parts = chosen_parts(mesh)
        if mesh.get(SHOT, 0) != shot:
            surface = meshes.build(mesh, source, shot, parts, own, axis_of(settings), settings.scale)
            mesh[SHOT] = shot
        else:
            surface = source.surface(shot, parts)
        if len(mesh.vertices) != surface.stop - surface.first or len(mesh.polygons) != len(surface.sizes):
            there, here = f"{surface.stop - surface.first} vertices and {len(surface.sizes)} polygons", len(mesh.vertices)
            raise ValueError(f"{path} has {there}, the mesh {here} and {len(mesh.polygons)}; import the file again")
        points = source.turned(positions[surface.first : surface.stop], axis_of(settings), settings.scale)
        meshes.show(mesh, source, surface, shot, own, points, settings.fields)
    except Exception as error:  # a handler must go on: other meshes follow other files
        return _refuse(mesh, describe(error))
    problems.pop(mesh.name, None)
    return True


def describe(error: Exception) -> str:
    """What went wrong, in one line."""
    if isinstance(error, ImportError) and error.name == "cv2":
        return "this file has JPEG pictures, which need OpenCV; the extension comes without it. Encode the file again as H.264"
    if isinstance(error, ImportError):
        return f"gvpipe cannot be loaded: {error}"
    return str(error) or type(error).__name__


def _refuse(mesh: Any, message: str) -> bool:
    if problems.get(mesh.name) != message:
        print(f"Geometry Video: mesh {mesh.name!r} stays as it is: {message}")
    problems[mesh.name] = message
    return False


@persistent
def follow(scene: Any, _: Any = None) -> None:
    """Let all meshes show the scene's frame; those that are being edited stay."""
    for mesh in bpy.data.meshes:
        if mesh.users and mesh.geometry_video.filepath and not mesh.is_editmode:
            follow_mesh(mesh, scene.frame_current)


@persistent
def follow_again(*_: Any) -> None:
    """After a file was loaded, and after undo and redo: meshes may be of another frame."""
    problems.clear()
    follow(bpy.context.scene)


@persistent
def rebase(target: str, *_: Any) -> None:
    """Before a .blend is saved: relative paths count from its new folder; those of an unsaved one become relative."""
    _rebased.clear()
    for mesh in bpy.data.meshes:
        path = mesh.geometry_video.filepath
        if path and mesh.library is None and (path.startswith("//") or not bpy.data.filepath) and target:
            _rebased[mesh.name] = absolute(mesh)
            _set_path(mesh, relative(_rebased[mesh.name], os.path.dirname(target)))


@persistent
def rebase_back(*_: Any) -> None:
    """After a copy was saved: paths count from the folder of the .blend that is open."""
    for name, path in _rebased.items():
        if (mesh := bpy.data.meshes.get(name)) is not None:
            _set_path(mesh, relative(path))
    _rebased.clear()


def relative(path: str, folder: str = "") -> str:
    """A path that counts from a folder, by default that of the .blend; itself where there is none, or on another drive."""
    folder = folder or os.path.dirname(bpy.data.filepath)
    try:
        return bpy.path.relpath(path, start=folder) if folder else path
    except ValueError:  # another drive
        return path


def _set_path(mesh: Any, path: str) -> None:
    if mesh.geometry_video.filepath != path:
        mesh.geometry_video.filepath = path


HANDLERS = (
    ("frame_change_pre", follow),
    ("load_post", follow_again),
    ("undo_post", follow_again),
    ("redo_post", follow_again),
    ("save_pre", rebase),
    ("save_post", rebase_back),
)


def register() -> None:
    bpy.utils.register_class(GeometryVideo)
    bpy.utils.register_class(DATA_PT_geometry_video)
    bpy.types.Mesh.geometry_video = bpy.props.PointerProperty(type=GeometryVideo)
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    for name, handler in HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
    del bpy.types.Mesh.geometry_video
    bpy.utils.unregister_class(DATA_PT_geometry_video)
    bpy.utils.unregister_class(GeometryVideo)
    problems.clear()
    close_all()
