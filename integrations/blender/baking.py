"""Bake: a mesh that follows a file becomes one that Blender moves by itself, so that the .blend opens without the extension."""

import os
from typing import Any

import bpy
import numpy as np

from . import playing
from .sources import Source, Surface, opened

TARGETS = (
    ("SHAPE_KEYS", "Shape Keys", "A key for each frame in the .blend; 12 bytes for each vertex and frame"),
    ("PC2", "PC2 Cache", "A .pc2 file, played by a Mesh Cache modifier"),
    ("ALEMBIC", "Alembic Cache", "An .abc file, played by a Mesh Sequence Cache modifier; vertices and triangles may change"),
)
SUFFIXES = {"PC2": ".pc2", "ALEMBIC": ".abc"}


class OBJECT_OT_geometry_video_bake(bpy.types.Operator):
    """Let Blender move the selected meshes by itself, so that the file opens without this extension"""

    bl_idname = "object.geometry_video_bake"
    bl_label = "Bake Geometry Video"
    bl_options = {"REGISTER", "UNDO"}

    target: bpy.props.EnumProperty(name="To", items=TARGETS)
    directory: bpy.props.StringProperty(
        name="Folder", description="Of caches; empty: beside the .blend", subtype="DIR_PATH", default=""
    )

    @classmethod
    def poll(cls, context: Any) -> bool:
        return any(_follows(each) for each in (*context.selected_objects, context.object))

    def invoke(self, context: Any, event: Any) -> set[str]:
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context: Any) -> set[str]:
        chosen = {each.data.name: each for each in (context.object, *context.selected_objects) if _follows(each)}
        folder = bpy.path.abspath(self.directory or "//") if self.directory or bpy.data.filepath else ""
        if self.target in SUFFIXES and not folder:
            self.report({"ERROR"}, "a cache needs a folder; save the .blend first, or name one")
            return {"CANCELLED"}
        context.window_manager.progress_begin(0, len(chosen))
        try:
            for number, object_ in enumerate(chosen.values()):
                context.window_manager.progress_update(number)
                bake(context, object_, self.target, folder)
        except Exception as error:
            self.report({"ERROR"}, playing.describe(error))
            return {"CANCELLED"}
        finally:
            context.window_manager.progress_end()
        return {"FINISHED"}


def _follows(object_: Any) -> bool:
    return object_ is not None and object_.type == "MESH" and bool(object_.data.geometry_video.filepath)


def bake(context: Any, object_: Any, target: str, folder: str) -> None:
    """Bake an object's mesh; it no longer follows its file then.

    Raises:
        ValueError: its triangles change, and the target cannot hold that.
        gvpipe.GvpipeError: the file cannot be read, or the cache not be written.
    """
    mesh, settings = object_.data, object_.data.geometry_video
    source = opened(playing.absolute(mesh))
    if target != "ALEMBIC" and not source.is_one_mesh:
        raise ValueError("its vertices or triangles change from frame to frame; bake it to Alembic")
    stem = os.path.splitext(os.path.basename(bpy.data.filepath))[0]
    name = bpy.path.clean_name(f"{stem}_{mesh.name}" if stem else mesh.name)
    path = os.path.join(folder, name + SUFFIXES.get(target, ""))
    if target == "ALEMBIC":
        _to_alembic(context, object_, source, path)
    else:
        frames = Baked(source, source.surface(0, playing.chosen_parts(mesh)), playing.axis_of(settings), settings.scale)
        if len(mesh.vertices) != frames.shape[1]:
            raise ValueError(f"the file has {frames.shape[1]} vertices here, the mesh {len(mesh.vertices)}; import it again")
        if target == "PC2":
            _to_pc2(object_, source, frames, path)
        else:
            _to_shape_keys(object_, frames)
    settings.filepath = ""
    playing.problems.pop(mesh.name, None)


class Baked:
    """Frames of a mesh as Blender has them: ``(F, n, 3) float32``, decoded as they are sliced."""

    dtype = np.dtype(np.float32)

    def __init__(self, source: Source, surface: Surface, up: str, scale: float) -> None:
        self._source, self._surface, self._up, self._scale = source, surface, up, scale
        self.shape = (len(source), surface.stop - surface.first, 3)

    def frame(self, number: int) -> Any:
        """One frame ``(n, 3)``."""
        points = self._source.positions(number)[2][self._surface.first : self._surface.stop]
        return self._source.turned(points, self._up, self._scale)

    def __getitem__(self, key: slice, /) -> Any:
        numbers = range(self.shape[0])[key]
        return np.stack([self.frame(number) for number in numbers]) if numbers else np.empty((0, *self.shape[1:]), np.float32)


def _to_shape_keys(object_: Any, frames: Baked) -> None:
    """Absolute keys, and an evaluation time that runs through them as the scene does."""
    mesh, settings = object_.data, object_.data.geometry_video
    if mesh.shape_keys is not None:
        object_.shape_key_clear()
    for number in range(frames.shape[0]):
        key = object_.shape_key_add(name=f"Frame {number}", from_mix=False)
        key.data.foreach_set("co", frames.frame(number).reshape(-1))
        key.interpolation = "KEY_LINEAR"
    keys = mesh.shape_keys
    keys.use_relative = False
    for number in dict.fromkeys((0, frames.shape[0] - 1)):
        keys.eval_time = keys.key_blocks[number].frame
        keys.keyframe_insert("eval_time", frame=settings.start + number / settings.speed)
    for curve in _curves(keys.animation_data.action):
        for point in curve.keyframe_points:
            point.interpolation = "LINEAR"
        if settings.repeat:
            curve.modifiers.new("CYCLES")


def _curves(action: Any) -> list[Any]:
    """All curves of an action; Blender 4.4 and newer have them in layers."""
    if not getattr(action, "layers", None):
        return list(action.fcurves)
    strips = [strip for layer in action.layers for strip in layer.strips]
    return [curve for strip in strips for bag in strip.channelbags for curve in bag.fcurves]


def _to_pc2(object_: Any, source: Source, frames: Baked, path: str) -> None:
    import gvpipe

    settings, surface = object_.data.geometry_video, source.surface(0, playing.chosen_parts(object_.data))
    faces = np.asarray(source.first_shot.faces)[surface.triangles] - surface.first
    gvpipe.write(gvpipe.MeshSequence(frames, faces, source.capture.fps, name=object_.name), path)
    modifier = object_.modifiers.new("Geometry Video", "MESH_CACHE")
    modifier.cache_format = "PC2"
    modifier.filepath = playing.relative(path)
    modifier.interpolation = "NONE"
    modifier.frame_start, modifier.frame_scale = settings.start, settings.speed


def _to_alembic(context: Any, object_: Any, source: Source, path: str) -> None:
    """By Blender's own exporter, while the mesh follows its file."""
    settings, scene = object_.data.geometry_video, context.scene
    selected, active, now = list(context.selected_objects), context.view_layer.objects.active, scene.frame_current
    for each in selected:
        each.select_set(False)
    object_.select_set(True)
    context.view_layer.objects.active = object_
    end = settings.start + (len(source) - 1) / settings.speed
    moving = object_.modifiers.new("moving", "SMOOTH")  # the exporter writes one frame of objects without modifiers
    moving.iterations = 0
    try:
        bpy.ops.wm.alembic_export(
            filepath=path, start=round(settings.start), end=round(end), selected=True, flatten=True, as_background_job=False
        )
        bpy.ops.cachefile.open(filepath=path)
    finally:
        object_.modifiers.remove(moving)
        scene.frame_set(now)
        for each in selected:
            each.select_set(True)
        context.view_layer.objects.active = active
    cache = next(each for each in reversed(bpy.data.cache_files) if os.path.samefile(bpy.path.abspath(each.filepath), path))
    cache.filepath = playing.relative(path)
    modifier = object_.modifiers.new("Geometry Video", "MESH_SEQUENCE_CACHE")
    modifier.cache_file = cache
    names = [_abc_name(each) for each in (object_.name, object_.data.name)]
    modifier.object_path = "/" + "/".join(names)


def _abc_name(name: str) -> str:
    """As Blender's exporter changes names."""
    return name.replace(" ", "_").replace(".", "_").replace(":", "_")


def register() -> None:
    bpy.utils.register_class(OBJECT_OT_geometry_video_bake)


def unregister() -> None:
    bpy.utils.unregister_class(OBJECT_OT_geometry_video_bake)
