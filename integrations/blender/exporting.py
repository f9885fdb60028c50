"""File > Export > Geometry Video: frames of the scene go to a temporary file, then gvpipe encodes them on a thread.

The work is a generator of steps, so that a window stays alive and Escape ends it; without a window the steps run through.
"""

import os
import tempfile
import threading
import time
from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import bpy
import numpy as np
from bpy_extras.io_utils import ExportHelper

from . import materials, playing
from .sampling import KINDS, Sample, sample, uv_names

CODECS = (
    ("default", "Default", "mcgv, which browsers play at thousands of frames a second; pca where triangles change"),
    ("auto", "Smallest", "Try all codecs, and keep the smallest file"),
    ("mcgv", "mcgv", "Multi-chart geometry video"),
    ("pca", "pca", "Trajectory PCA: small files, levels of detail"),
    ("laplacian", "laplacian", "Least perceived error"),
    ("pdct", "pdct", "Predictive DCT: streams"),
)
SAMPLED = 0.4  # part of the progress bar

Steps = Generator[tuple[str, float], None, list[str]]


class Cancelled(Exception):
    """The user stopped the export."""


class EXPORT_OT_geometry_video(bpy.types.Operator, ExportHelper):
    """Export the selected objects, with modifiers, over the scene's frames; all visible ones if none is selected"""

    bl_idname = "export_scene.geometry_video"
    bl_label = "Export Geometry Video"
    bl_options = {"REGISTER"}
    filename_ext = ".mp4"
    check_extension = None  # .glb may stand there, too

    filter_glob: bpy.props.StringProperty(default="*.mp4;*.glb", options={"HIDDEN"})
    codec: bpy.props.EnumProperty(name="Codec", items=CODECS)
    quality: bpy.props.FloatProperty(name="Quality", description="Higher is better", default=75, min=0, max=100)
    max_error: bpy.props.StringProperty(
        name="Max Error", description="That no vertex exceeds: units of the scene, or a part of the diagonal such as 0.1%"
    )
    attributes: bpy.props.BoolProperty(
        name="Attributes", description="Numbers on points and faces; fields if they move", default=True
    )
    stream: bpy.props.BoolProperty(name="Stream Layout", description="The file plays over HTTP while it loads", default=False)
    skin: bpy.props.BoolProperty(
        name="Skinned GLB",
        description="A .glb with a skeleton that moves the mesh, for every engine, in place of .mp4",
        default=False,
    )

    def execute(self, context: Any) -> set[str]:
        path = bpy.path.abspath(self.filepath)
        path = bpy.path.ensure_ext(path, ".glb" if self.skin or path.lower().endswith(".glb") else ".mp4")
        chosen = [each for each in context.selected_objects if each.type in KINDS] or [
            each for each in context.view_layer.objects if each.type in KINDS and each.visible_get()
        ]
        options = {"quality": self.quality}
        if self.codec != "default":
            options["codec"] = self.codec
        if self.max_error.strip():
            options["max_error"] = self.max_error.strip()
        if self.stream:
            options["stream"] = True
        self._steps = steps(context, chosen, os.path.abspath(path), options, self.attributes)
        if bpy.app.background or context.window is None:
            return self._finish(context, to_the_end=True)
        context.window_manager.progress_begin(0, 100)
        self._timer = context.window_manager.event_timer_add(0.02, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        if event.type == "ESC":
            self._steps.close()
            self._tidy(context)
            self.report({"INFO"}, "cancelled; no file was written")
            return {"CANCELLED"}
        return self._finish(context, to_the_end=False) if event.type == "TIMER" else {"RUNNING_MODAL"}

    def _finish(self, context: Any, to_the_end: bool) -> set[str]:
        """Go one step, or all; report how it ended."""
        try:
            while True:
                what, part = next(self._steps)
                if not to_the_end:
                    context.window_manager.progress_update(int(100 * part))
                    context.workspace.status_text_set(f"Geometry Video: {what}, {part:.0%}; Escape cancels")
                    return {"RUNNING_MODAL"}
        except StopIteration as end:
            for line in end.value:
                self.report({"INFO"}, line)
            result = {"FINISHED"}
        except Exception as error:
            self.report({"ERROR"}, playing.describe(error))
            result = {"CANCELLED"}
        if not to_the_end:
            self._tidy(context)
        return result

    def _tidy(self, context: Any) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)


def steps(context: Any, chosen: list[Any], path: str, options: dict[str, Any], with_attributes: bool) -> Steps:
    """Export objects; yields what is done and the part of the whole, and returns what a user should know.

    Closing it ends the work without a file.

    Raises:
        ValueError: there is nothing to export, or a skinned GLB of triangles that change.
        gvpipe.GvpipeError: the file cannot be encoded or written.
    """
    import gvpipe

    scene = context.scene
    now, names = scene.frame_current, {each.name for each in chosen}
    frames = range(scene.frame_start, scene.frame_end + 1, scene.frame_step)
    numbered: dict[str, int] = {}
    with tempfile.TemporaryFile() as file:
        takes: list[Take] = []
        try:
            for number, frame in enumerate(frames):
                yield f"frame {frame}", SAMPLED * number / len(frames)
                scene.frame_set(frame)
                found = sample(context.evaluated_depsgraph_get(), names, numbered)
                if found is None:
                    raise ValueError(
                        f"nothing with polygons is there at frame {frame}; select a mesh, or shorten the scene's range"
                    )
                if not takes or not takes[-1].first.has_same_surface(found):
                    takes.append(Take(found, file.tell()))
                takes[-1].add(found, file)
        finally:
            scene.frame_set(now)
        file.flush()
        fps = scene.render.fps / scene.render.fps_base / scene.frame_step
        layers = uv_names([each.data for each in chosen if each.type == "MESH"])
        given = [bpy.data.materials[name] for name in numbered]
        looks, images = materials.from_blender(given, layers)
        metadata = gvpipe.Metadata("z", scene.unit_settings.scale_length, source=f"Blender {bpy.app.version_string}")
        name = os.path.splitext(os.path.basename(path))[0]
        shots = [take.sequence(file, fps, looks, images, metadata, with_attributes, name) for take in takes]
        stop, bar = threading.Event(), Bar()

        def told(stage: str, part: float) -> None:
            if stop.is_set():
                raise Cancelled
            bar.show(stage, part)

        with ThreadPoolExecutor(1) as pool:
            work = pool.submit(_write, shots, path, options, told)
            try:
                while not work.done():
                    yield bar.stage, SAMPLED + (1 - SAMPLED) * bar.part
                    time.sleep(0.02)
            finally:
                stop.set()
            result: list[str] = work.result()
            return result


class Bar:
    """Stages of unknown number in one bar: each takes half of what is left."""

    def __init__(self) -> None:
        self.stage, self.part, self._stages = "encoding", 0.0, 0

    def show(self, stage: str, part: float) -> None:
        """Take note of the part of a stage that is done."""
        self._stages += stage != self.stage
        self.stage, self.part = stage, max(self.part, 1 - (1 - part / 2) * 0.5 ** max(self._stages - 1, 0))


def _write(shots: list[Any], path: str, options: dict[str, Any], told: Any) -> list[str]:
    import gvpipe

    if path.lower().endswith(".glb"):
        if len(shots) > 1:
            raise ValueError("vertices or triangles change from frame to frame, so no skeleton can move them; export .mp4")
        skin = gvpipe.skin(shots[0], progress=told)
        notes = gvpipe.write(shots[0], path, skin=skin)
        return [f"{path}: {os.path.getsize(path)} bytes, {skin.joints} joints, {skin.error:.2g} % KG", *(notes or ())]
    source = shots[0] if len(shots) == 1 else gvpipe.Capture(shots, name=shots[0].name)
    report = gvpipe.encode(source, path, progress=told, **options)
    return [f"{path}: {report.bytes} bytes, {report.frames} frames, {report.bpvf:.2f} bits per vertex and frame", *report.notes]


class Take:
    """Frames of one surface, one behind the other in a file: positions, then all numbers, 4 bytes each."""

    def __init__(self, first: Sample, start: int) -> None:
        self.first, self._start, self._length = first, start, 0
        self._moving: set[str] = set()

    def add(self, found: Sample, file: Any) -> None:
        """Append a frame."""
        file.write(found.points.tobytes())
        for name, numbers in found.numbers.items():
            file.write(numbers.rows.tobytes())
            if name not in self._moving and not np.array_equal(numbers.rows, self.first.numbers[name].rows, equal_nan=True):
                self._moving.add(name)
        self._length += 1

    def sequence(self, file: Any, fps: float, looks: Any, images: Any, metadata: Any, with_attributes: bool, name: str) -> Any:
        """The frames as a `gvpipe.MeshSequence` over the file: what moves is a field, what stands still an attribute."""
        import gvpipe

        sizes = {"": self.first.points.size, **{name: each.rows.size for name, each in self.first.numbers.items()}}
        record = sum(sizes.values())
        words = np.memmap(file, np.float32, "r", self._start, (self._length, record))
        places = dict(zip(sizes, np.cumsum([0, *sizes.values()]).tolist(), strict=False))
        attributes, fields = {}, {}
        for each, numbers in self.first.numbers.items():
            is_look = numbers.kind in ("uv", "color")
            if not (with_attributes or is_look) or not np.isfinite(numbers.rows).all():
                continue
            if each in self._moving and numbers.domain != "corner":
                view = words[:, places[each] : places[each] + sizes[each]]
                rows = Rows(view, numbers.rows.shape, numbers.rows.dtype)
                fields[each] = gvpipe.Field(rows, numbers.domain, numbers.kind or _kind(numbers.rows), name=each)
            else:
                attributes[each] = gvpipe.Attribute(numbers.rows, numbers.domain, numbers.kind, name=each)
        return gvpipe.MeshSequence(
            Rows(words[:, : sizes[""]], self.first.points.shape, np.dtype(np.float32)),
            self.first.faces,
            fps,
            attributes,
            name,
            fields=fields,
            parts=[gvpipe.Part(*part) for part in self.first.parts],
            polygons=None if (self.first.sizes == 3).all() else self.first.sizes,
            materials=looks,
            images=images,
            metadata=metadata,
        )


def _kind(rows: Any) -> str:
    return "vector" if rows.shape[1] > 1 else "label" if rows.dtype.kind == "i" else "scalar"


class Rows:
    """Frames ``(F, rows, C)`` in a mapped file, copied as they are sliced."""

    def __init__(self, words: Any, form: tuple[int, ...], dtype: Any) -> None:
        self._words, self.dtype, self.shape = words, dtype, (len(words), *form)

    def __getitem__(self, key: slice, /) -> Any:
        block = np.ascontiguousarray(self._words[key]).view(self.dtype)
        return block.reshape(len(block), *self.shape[1:])


def _menu(self: Any, context: Any) -> None:
    self.layout.operator(EXPORT_OT_geometry_video.bl_idname, text="Geometry Video (.mp4)")


def register() -> None:
    bpy.utils.register_class(EXPORT_OT_geometry_video)
    bpy.types.TOPBAR_MT_file_export.append(_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_export.remove(_menu)
    bpy.utils.unregister_class(EXPORT_OT_geometry_video)
