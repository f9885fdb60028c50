"""File > Import > Geometry Video: a mesh for each part, materials, and the scene's rate and range."""

import os
from math import ceil
from typing import Any

import bpy
from bpy_extras.io_utils import ImportHelper

from . import materials, meshes, playing
from .sources import Source, opened, with_its_frames

MOST_MESHES = 256  # of more parts, one mesh is made
GLOB = "*.mp4;*.npz;*.obj;*.ply;*.stl;*.off;*.glb;*.gltf"


class IMPORT_OT_geometry_video(bpy.types.Operator, ImportHelper):
    """Import a geometry video, or frames that gvpipe reads; they play with the timeline"""

    bl_idname = "import_scene.geometry_video"
    bl_label = "Import Geometry Video"
    bl_options = {"REGISTER", "UNDO"}
    filename_ext = ".mp4"

    filter_glob: bpy.props.StringProperty(default=GLOB, options={"HIDDEN"})
    set_scene: bpy.props.BoolProperty(
        name="Set Frame Rate and Range",
        description="Give the scene the file's frames per second and its frames; else the speed keeps the file's clock",
        default=True,
    )
    split_parts: bpy.props.BoolProperty(
        name="Object for Each Part", description="Else one object, whose materials are slots", default=True
    )
    numbered: bpy.props.BoolProperty(
        name="Numbered Files", description="A numbered OBJ, PLY, STL or OFF file stands for all of its number", default=True
    )
    up: bpy.props.EnumProperty(name="Up", items=playing.UP_AXES)
    relative_path: bpy.props.BoolProperty(name="Relative Path", description="Relative to the saved .blend", default=True)

    def execute(self, context: Any) -> set[str]:
        path = os.path.abspath(bpy.path.abspath(self.filepath))
        try:
            source = opened(with_its_frames(path) if self.numbered else path)
            if self.set_scene:
                set_scene(context.scene, source)
            made = place(context, source, self.split_parts, "" if self.up == "AUTO" else self.up.lower(), self.relative_path)
        except Exception as error:
            self.report({"ERROR"}, playing.describe(error))
            return {"CANCELLED"}
        if source.has_sound and not add_sound(context.scene, source):
            self.report({"WARNING"}, "without sound, which this Blender cannot read")
        for object_ in context.selected_objects:
            object_.select_set(False)
        for object_ in made:
            object_.select_set(True)
        context.view_layer.objects.active = made[0]
        if lost := meshes.skipped(source.first_shot):
            self.report({"WARNING"}, f"without what has more than 4 components: {', '.join(lost)}")
        if any(image.is_moving for image in source.first_shot.images):
            self.report({"WARNING"}, "textures that move show their first picture")
        return {"FINISHED"}


def place(context: Any, source: Source, split: bool, up: str, relative: bool) -> list[Any]:
    """Make the objects of a source, which follow it from the scene's first frame.

    Returns:
        those with meshes.
    """
    sequence = source.first_shot
    pieces = grouped(sequence) if split and source.is_one_mesh else [()]
    name = os.path.splitext(os.path.basename(source.path))[0]
    unit = (sequence.metadata.metres_per_unit or 1.0) / context.scene.unit_settings.scale_length
    looks = all_looks(source, name)
    owners: dict[str, Any] = {}
    root = empty(context, name) if len(pieces) > 1 else None
    made = []
    for parts in pieces or [()]:
        part = sequence.parts[parts[0]] if parts else None
        mesh = bpy.data.meshes.new(part.name if part and part.name else name)
        add_slots(mesh, sequence, parts, looks)
        meshes.build(mesh, source, 0, parts, 0, up, unit)
        mesh[playing.SHOT] = 0
        object_ = bpy.data.objects.new(mesh.name, mesh)
        context.collection.objects.link(object_)
        object_.location = source.turned(source.first_shot.origin, up, unit)
        if root is not None:
            if part and part.parent and part.parent not in owners:
                owners[part.parent] = empty(context, part.parent, root)
            object_.parent = owners.get(part.parent if part else "", root)
        settings = mesh.geometry_video
        settings.up, settings.scale, settings.parts = (up.upper() or "AUTO"), unit, ",".join(map(str, parts))
        settings.start = context.scene.frame_start
        render = context.scene.render
        settings.speed = source.capture.fps * render.fps_base / render.fps
        settings.filepath = playing.relative(source.path) if relative else source.path
        made.append(object_)
    for object_ in made:
        playing.follow_mesh(object_.data, context.scene.frame_current)
    context.scene.render.use_lock_interface = True  # Blender's advice where handlers change meshes while it renders
    return made


def grouped(sequence: Any) -> list[tuple[int, ...]]:
    """Parts that are one object: of one name and parent, over the same vertices. ``[()]``: the whole is one."""
    groups: dict[Any, list[int]] = {}
    for number, part in enumerate(sequence.parts):
        groups.setdefault((part.name, part.parent, part.vertices), []).append(number)
    found = [tuple(each) for each in groups.values()]
    return found if 1 < len(found) <= MOST_MESHES else [()]


def empty(context: Any, name: str, parent: Any = None) -> Any:
    """An object without a mesh, which others hang on."""
    made = bpy.data.objects.new(name, None)
    context.collection.objects.link(made)
    made.parent = parent
    return made


def all_looks(source: Source, name: str) -> list[Any]:
    """Materials of Blender, one for each of the file; of a file without, one that shows its colours."""
    sequence = source.first_shot
    uv = {each: meshes.attribute_name(each) for each, attribute in sequence.attributes.items() if attribute.kind == "uv"}
    images = [materials.image_to_blender(image) for image in sequence.images]
    found = [materials.to_blender(material, images, uv) for material in sequence.materials]
    layers = [*sequence.attributes.items(), *sequence.fields.items()]
    color = next((each for each, attribute in layers if attribute.kind == "color"), None)
    return found or ([materials.colored(name, meshes.attribute_name(color))] if color else [])


def add_slots(mesh: Any, sequence: Any, parts: tuple[int, ...], looks: list[Any]) -> None:
    """A slot for each material that the parts have, in the order of `meshes.build`."""
    if not sequence.parts or not sequence.materials:
        for look in looks:
            mesh.materials.append(look)
        return
    chosen = parts or range(len(sequence.parts))
    slots = sorted({-1 if (material := sequence.parts[number].material) is None else material for number in chosen})
    for slot in slots:
        mesh.materials.append(None if slot < 0 else looks[slot])


def set_scene(scene: Any, source: Source) -> None:
    """Give a scene the rate of a source, and its frames from the scene's first one."""
    rate = source.capture.fps
    whole = max(1, ceil(rate))
    scene.render.fps, scene.render.fps_base = whole, whole / rate
    scene.frame_end = scene.frame_start + len(source) - 1


def add_sound(scene: Any, source: Source) -> bool:
    """Add a strip of the file's sound to the sequencer, from the scene's first frame; False: this Blender reads no sound."""
    if not bpy.app.build_options.audaspace:
        return False
    editor = scene.sequence_editor_create()
    strips = editor.strips if hasattr(editor, "strips") else editor.sequences  # of Blender before 4.4
    channel = 1 + max((strip.channel for strip in strips), default=0)
    strips.new_sound(os.path.basename(source.path), source.path, channel, scene.frame_start)
    return True


class IO_FH_geometry_video(bpy.types.FileHandler):
    """Files that are dropped into the view."""

    bl_idname = "IO_FH_geometry_video"
    bl_label = "Geometry Video"
    bl_import_operator = "import_scene.geometry_video"
    bl_file_extensions = ".mp4"

    @classmethod
    def poll_drop(cls, context: Any) -> bool:
        return context.area is not None and context.area.type == "VIEW_3D"


def _menu(self: Any, context: Any) -> None:
    self.layout.operator(IMPORT_OT_geometry_video.bl_idname, text="Geometry Video (.mp4)")


def register() -> None:
    bpy.utils.register_class(IMPORT_OT_geometry_video)
    bpy.utils.register_class(IO_FH_geometry_video)
    bpy.types.TOPBAR_MT_file_import.append(_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_import.remove(_menu)
    bpy.utils.unregister_class(IO_FH_geometry_video)
    bpy.utils.unregister_class(IMPORT_OT_geometry_video)
