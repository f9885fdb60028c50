"""What the extension in integrations/blender does in Blender: python blender_extension.py STEP FOLDER (a Python with bpy).

STEP is the name of a function here; FOLDER has the files of test_blender_extension.py. Positions go to ``STEP.npz`` there, all
else to ``STEP.json``.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

EXTENSION = Path(__file__).parents[1] / "integrations" / "blender"
bpy: Any = import_module("bpy")  # it has no types
Found = tuple[dict[str, Any], dict[str, Any]]  # positions by name, and what JSON holds


def load() -> Any:
    """The extension as a module, registered."""
    spec = importlib.util.spec_from_file_location(
        "geometry_video", EXTENSION / "__init__.py", submodule_search_locations=[str(EXTENSION)]
    )
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules["geometry_video"] = module
    spec.loader.exec_module(module)
    module.register()
    return module


def points() -> Any:
    """The vertices ``(n, 3)`` of all evaluated meshes in world space, by name of their objects."""
    graph = bpy.context.evaluated_depsgraph_get()
    found = []
    for each in sorted(meshes(), key=lambda each: str(each.name)):
        placed = each.evaluated_get(graph)
        own = np.empty(3 * len(placed.data.vertices), np.float32)
        placed.data.vertices.foreach_get("co", own)
        world = np.array(placed.matrix_world)
        found.append(own.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3])
    return np.concatenate(found)


def meshes() -> list[Any]:
    """The objects that have meshes."""
    return [each for each in bpy.context.scene.objects if each.type == "MESH"]


def film(n_frames: int) -> list[Any]:
    """`points` of so many frames of the scene."""
    scene, frames = bpy.context.scene, []
    for frame in range(n_frames):
        scene.frame_set(scene.frame_start + frame)
        frames.append(points())
    return frames


def values(mesh: Any, name: str) -> list[Any]:
    """Numbers of an attribute."""
    attribute = mesh.attributes[name]
    width = {"FLOAT": 1, "INT": 1, "FLOAT2": 2, "FLOAT_VECTOR": 3, "FLOAT_COLOR": 4}[attribute.data_type]
    rows = np.empty(width * len(attribute.data), np.int32 if attribute.data_type == "INT" else np.float32)
    attribute.data.foreach_get("color" if width == 4 else "value" if width == 1 else "vector", rows)
    found: list[Any] = rows.reshape(-1, width).tolist()
    return found


def sounds(scene: Any) -> list[str]:
    """Names of the strips in the sequencer."""
    editor = scene.sequence_editor
    strips = () if editor is None else editor.strips if hasattr(editor, "strips") else editor.sequences  # before Blender 4.4
    return [strip.name for strip in strips]


def imported(folder: Path) -> Found:
    """Import, step, undo, render, save, export again, switch off."""
    scene = bpy.context.scene
    module = load()
    assert bpy.ops.import_scene.geometry_video(filepath=str(folder / "scene.mp4")) == {"FINISHED"}
    frames = film(10)
    scene.frame_set(scene.frame_start + 7)
    first = meshes()[0].data
    told = {
        "objects": {each.name: [slot.name for slot in each.data.materials] for each in meshes()},
        "parents": sorted({each.parent.name for each in meshes() if each.parent}),
        "fps": scene.render.fps / scene.render.fps_base,
        "frames": [scene.frame_start, scene.frame_end],
        "uv": [layer.name for layer in first.uv_layers],
        "attributes": {each.name: [each.data_type, each.domain] for each in first.attributes if not each.name.startswith(".")},
        "stress": values(first, "stress"),
        "state": values(first, "state"),
        "polygons": sum(len(each.data.polygons) for each in meshes()),
        "images": sorted(each.name for each in bpy.data.images if each.packed_file),
        "sounds": sounds(scene),
        "reads sound": bpy.app.build_options.audaspace,
        "valid": [not each.data.validate(verbose=False) for each in meshes()],
    }
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "saved" / "scene.blend"))
    told["path"] = meshes()[0].data.geometry_video.filepath
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "saved" / "deep" / "copy.blend"), copy=True)
    told["path after a copy"] = meshes()[0].data.geometry_video.filepath
    exported = folder / "again.mp4"
    assert bpy.ops.export_scene.geometry_video(filepath=str(exported), codec="pca", max_error="0.01%") == {"FINISHED"}
    told["frame after export"] = scene.frame_current
    module.unregister()
    told["left"] = [hasattr(bpy.types.Mesh, "geometry_video"), len(bpy.app.handlers.frame_change_pre)]
    return {"frames": np.stack(frames)}, told


def reopened(folder: Path) -> Found:
    """Open what `imported` saved, also a copy elsewhere; hide the video; undo."""
    module = load()
    bpy.ops.wm.open_mainfile(filepath=str(folder / "saved" / "deep" / "copy.blend"))
    scene = bpy.context.scene
    loaded = points()  # of the frame that was saved
    frames = film(10)
    bpy.ops.ed.undo_push(message="before")
    scene.frame_set(scene.frame_start + 2)
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    undone = {"undone": points(), "shown": np.array(bpy.context.scene.frame_current - bpy.context.scene.frame_start)}
    (folder / "scene.mp4").rename(folder / "moved.mp4")
    scene = bpy.context.scene
    scene.frame_set(scene.frame_start + 4)
    stays, problems = points(), dict(module.playing.problems)
    for each in meshes():
        each.data.geometry_video.filepath = "//../../moved.mp4"
    found = points()
    (folder / "moved.mp4").rename(folder / "scene.mp4")
    arrays = {"loaded": loaded, "frames": np.stack(frames), "stays": stays, "found": found, **undone}
    return arrays, {"problems": problems, "left": dict(module.playing.problems)}


def baked(folder: Path) -> Found:
    """Bake to keys and caches, switch the extension off, step."""
    arrays: dict[str, Any] = {}
    for target, name in (("SHAPE_KEYS", "scene"), ("PC2", "scene"), ("ALEMBIC", "scene"), ("ALEMBIC", "capture")):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        module = load()
        bpy.ops.import_scene.geometry_video(filepath=str(folder / f"{name}.mp4"))
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{target}_{name}.blend"))
        assert bpy.ops.object.geometry_video_bake(target=target) == {"FINISHED"}, target
        bpy.ops.wm.save_mainfile()
        module.unregister()
        bpy.ops.wm.open_mainfile(filepath=str(folder / f"{target}_{name}.blend"))
        frames = film(10)
        arrays |= {f"{target}_{name}_{number}": each for number, each in enumerate(frames)}
    return arrays, {}


def others(folder: Path) -> Found:
    """A capture, frames in OBJ files, a mesh with modifiers, one whose triangles change, a skinned GLB, and refusals."""
    load()
    told: dict[str, Any] = {}
    scene = bpy.context.scene
    bpy.ops.import_scene.geometry_video(filepath=str(folder / "capture.mp4"))
    capture = film(scene.frame_end - scene.frame_start + 1)
    told["counts"] = [len(each) for each in capture]
    assert bpy.ops.export_scene.geometry_video(filepath=str(folder / "capture_again.mp4"), max_error="0.01%") == {"FINISHED"}
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.geometry_video(filepath=str(folder / "objs" / "sheet_0000.obj"))
    arrays = {"objs": np.stack(film(10))}
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.render.fps = 48  # twice the file's
    bpy.ops.import_scene.geometry_video(filepath=str(folder / "scene.mp4"), set_scene=False)
    for each in meshes():
        each.data.geometry_video.repeat = True
    arrays["slow"] = np.stack(film(24))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_cube_add(size=2)
    cube, scene = bpy.context.object, bpy.context.scene
    cube.modifiers.new("fine", "SUBSURF").levels = 2
    for frame, height in ((1, 0.0), (8, 3.0)):
        cube.location.z = height
        cube.keyframe_insert("location", index=2, frame=frame)
    cube.scale.x = -1  # mirrored
    scene.frame_end = 8
    arrays["cube"] = np.stack(film(8))
    assert bpy.ops.export_scene.geometry_video(filepath=str(folder / "cube.mp4"), max_error="0.0001") == {"FINISHED"}
    assert bpy.ops.export_scene.geometry_video(filepath=str(folder / "cube.glb")) == {"FINISHED"}
    told["refused"] = []
    for operator, path, options in (
        (bpy.ops.import_scene.geometry_video, folder / "none.mp4", {}),
        (bpy.ops.import_scene.geometry_video, folder / "objs" / "sheet_0000.mp4", {}),
        (bpy.ops.export_scene.geometry_video, folder / "no" / "folder.mp4", {}),
        (bpy.ops.export_scene.geometry_video, folder / "bad.mp4", {"max_error": "much"}),
    ):
        try:
            operator(filepath=str(path), **options)
        except RuntimeError as error:
            told["refused"].append(str(error))
    steps = sys.modules["geometry_video"].exporting.steps
    work = steps(bpy.context, [cube], str(folder / "stopped.mp4"), {}, True)
    for what, _ in work:
        if not what.startswith("frame"):
            break
    work.close()  # as Escape does
    told["stopped"] = [(folder / "stopped.mp4").exists(), scene.frame_current]
    told["modal"] = [modal(folder, [cube], stops) for stops in (False, True)]
    return arrays, told


def modal(folder: Path, chosen: list[Any], stops: bool) -> list[Any]:
    """Export as a window does it, event by event, and stop it by Escape if ``stops``: how it ended, what it told."""
    operator = sys.modules["geometry_video"].exporting.EXPORT_OT_geometry_video
    path = folder / f"modal{stops}.mp4"
    told: list[str] = []
    shown: list[float] = []

    class Window:
        """What an operator has of itself, and of its window."""

        modal, _finish, _tidy, _timer = operator.modal, operator._finish, operator._tidy, None
        window_manager = SimpleNamespace(
            progress_update=shown.append, progress_end=lambda: None, event_timer_remove=lambda timer: None
        )
        workspace = SimpleNamespace(status_text_set=lambda text: None)

        def report(self, kind: set[str], text: str) -> None:
            told.append(text)

    window, ended = Window(), {"RUNNING_MODAL"}
    window._steps = sys.modules["geometry_video"].exporting.steps(bpy.context, chosen, str(path), {}, True)  # type: ignore[attr-defined]
    while "RUNNING_MODAL" in ended:
        is_enough = stops and shown and shown[-1] >= 40
        ended = window.modal(window, SimpleNamespace(type="ESC" if is_enough else "TIMER"))
    return [sorted(ended)[0], path.exists(), told, shown == sorted(shown)]


def installed(folder: Path) -> Found:
    """Install a zip by Blender's own operator, import by it, remove it."""
    addon_utils: Any = import_module("addon_utils")
    addon_utils.enable("bl_pkg", default_set=True)
    zip_file = str(folder / "extension.zip")
    tool = Path(addon_utils.__file__).parents[1] / "addons_core/bl_pkg/cli/blender_ext.py"  # of `blender --command extension`
    done = subprocess.run([sys.executable, str(tool), "validate", zip_file], capture_output=True, text=True, check=False)
    bpy.ops.extensions.package_install_files(filepath=zip_file, repo="user_default", enable_on_install=True)
    assert bpy.ops.import_scene.geometry_video(filepath=str(folder / "scene.mp4")) == {"FINISHED"}
    told = {"modules": [name for name in sys.modules if name.endswith(".geometry_video")], "objects": len(meshes())}
    told["validated"] = done.stdout + done.stderr
    bpy.ops.extensions.package_uninstall(repo_index=1, pkg_id="geometry_video")
    told["left"] = hasattr(bpy.types.Mesh, "geometry_video")
    return {}, told


def pictured(folder: Path) -> Found:
    """Render a frame by Cycles, as ``blender -b FILE -a`` does: the picture of docs/integrations.md."""
    load()
    scene, gallery = bpy.context.scene, EXTENSION.parents[1] / "docs" / "gallery"
    bpy.ops.import_scene.geometry_video(filepath=str(gallery / "creature.mp4"))
    bpy.context.object.location, bpy.context.object.rotation_euler = (0.6, -1.2, 0), (0, 0, 1.0)
    bpy.ops.import_scene.geometry_video(filepath=str(gallery / "flag.mp4"))
    bpy.ops.mesh.primitive_plane_add(size=200)
    place("Camera", bpy.data.cameras.new("Camera"), (0.6, -6.2, 1.6), (1.48, 0, 0))
    light = bpy.data.lights.new("Sun", "SUN")
    light.energy, light.angle = 3.0, 0.1
    place("Sun", light, (0, 0, 5), (0.7, 0.3, 0.4))
    scene.camera, scene.render.engine, scene.cycles.samples = bpy.data.objects["Camera"], "CYCLES", 24
    scene.view_settings.view_transform = "Standard"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 480, 300, 100
    scene.frame_start = scene.frame_end = 20
    scene.render.filepath = str(folder / "picture_")
    bpy.ops.render.render(animation=True)
    image = bpy.data.images.load(str(folder / "picture_0020.png"))
    return {"pixels": np.array(image.pixels[:]).reshape(300, 480, 4)}, {}


def place(name: str, data: Any, location: tuple[float, ...], turn: tuple[float, ...]) -> None:
    """Put a camera or a light into the scene."""
    made = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(made)
    made.location, made.rotation_euler = location, turn


def main(step: str, folder: str) -> None:
    """Run a step in an empty scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    steps: dict[str, Callable[[Path], Found]] = {
        each.__name__: each for each in (imported, reopened, baked, others, installed, pictured)
    }
    arrays, told = steps[step](Path(folder))
    np.savez(Path(folder) / f"{step}.npz", **arrays)
    (Path(folder) / f"{step}.json").write_text(json.dumps(told), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
    sys.stdout.flush()
    os._exit(0)  # the module of Blender 4.2 crashes while Python ends, where a handler is registered
