"""Materials: gvpipe's, after glTF's metallic-roughness model, as Blender's Principled BSDF, and back."""

from __future__ import annotations

import os
import tempfile
from math import cos, sin
from typing import Any

import bpy

WRAPS = {"repeat": "REPEAT", "mirror": "MIRROR", "clamp": "EXTEND"}
MEDIA = ((b"\x89PNG", "image/png"), (b"\xff\xd8\xff", "image/jpeg"))  # first bytes of what other programs read
NUMBERS = {  # socket of the node: field of a material
    "Metallic": "metallic",
    "Roughness": "roughness",
    "IOR": "ior",
    "Coat Weight": "clearcoat",
    "Coat Roughness": "clearcoat_roughness",
    "Transmission Weight": "transmission",
}


def to_blender(material: Any, images: list[Any], uv_names: dict[str, str]) -> Any:
    """A material of Blender; ``images`` are Blender's, ``uv_names`` the layers of uv attributes."""
    made = bpy.data.materials.new(material.name or "Material")
    if bpy.app.version < (5, 0, 0):
        made.use_nodes = True
    made.use_backface_culling = not material.double_sided
    tree = made.node_tree
    node = next(each for each in tree.nodes if each.type == "BSDF_PRINCIPLED")
    sockets = node.inputs
    sockets["Base Color"].default_value = (*material.base_color[:3], 1.0)
    for socket, name in NUMBERS.items():
        sockets[socket].default_value = getattr(material, name)
    sockets["Emission Color"].default_value = (*material.emissive, 1.0)
    sockets["Emission Strength"].default_value = 1.0 if any(material.emissive) else 0.0
    is_clear = material.alpha_mode != "opaque"
    sockets["Alpha"].default_value = material.base_color[3] if is_clear else 1.0
    build = _Textures(tree, images, uv_names)
    if material.base_color_texture:
        picture = build.node(material.base_color_texture, is_color=True)
        color = build.times(picture.outputs["Color"], material.base_color[:3])
        tree.links.new(color, sockets["Base Color"])
        if is_clear:
            tree.links.new(picture.outputs["Alpha"], sockets["Alpha"])
    if material.metallic_roughness_texture:
        split = tree.nodes.new("ShaderNodeSeparateColor")
        picture = build.node(material.metallic_roughness_texture, is_color=False)
        tree.links.new(picture.outputs["Color"], split.inputs["Color"])
        for channel, socket, factor in (("Green", "Roughness", material.roughness), ("Blue", "Metallic", material.metallic)):
            tree.links.new(build.scaled(split.outputs[channel], factor), sockets[socket])
    if material.emissive_texture:
        picture = build.node(material.emissive_texture, is_color=True)
        tree.links.new(build.times(picture.outputs["Color"], material.emissive), sockets["Emission Color"])
        sockets["Emission Strength"].default_value = 1.0
    if material.normal_texture:
        bump = tree.nodes.new("ShaderNodeNormalMap")
        bump.uv_map = uv_names.get(material.normal_texture.uv, "")
        bump.inputs["Strength"].default_value = material.normal_texture.scale
        picture = build.node(material.normal_texture, is_color=False)
        tree.links.new(picture.outputs["Color"], bump.inputs["Color"])
        tree.links.new(bump.outputs["Normal"], sockets["Normal"])
    return made


def colored(name: str, attribute: str) -> Any:
    """A material that shows the colours of an attribute."""
    import gvpipe

    made = to_blender(gvpipe.Material(name, double_sided=True), [], {})
    tree = made.node_tree
    node = next(each for each in tree.nodes if each.type == "BSDF_PRINCIPLED")
    colors = tree.nodes.new("ShaderNodeVertexColor")
    colors.layer_name = attribute
    tree.links.new(colors.outputs["Color"], node.inputs["Base Color"])
    return made


def image_to_blender(image: Any) -> Any:
    """An image packed into the .blend; of a moving one, its first picture."""
    first = image.frame(0)
    made = bpy.data.images.new(os.path.basename(image.name) or "Image", 8, 8)
    made.pack(data=first.data, data_len=len(first.data))
    made.source = "FILE"
    return made


class _Textures:
    """Nodes of textures in one tree."""

    def __init__(self, tree: Any, images: list[Any], uv_names: dict[str, str]) -> None:
        self._tree, self._images, self._uv_names = tree, images, uv_names

    def node(self, texture: Any, is_color: bool) -> Any:
        node = self._tree.nodes.new("ShaderNodeTexImage")
        node.image = self._images[texture.image]
        if not is_color:
            node.image.colorspace_settings.name = "Non-Color"
        node.extension = WRAPS[texture.wrap[0]]
        node.interpolation = "Closest" if texture.filter == "nearest" else "Linear"
        uv = self._tree.nodes.new("ShaderNodeUVMap")
        uv.uv_map = self._uv_names.get(texture.uv, "")
        place = uv.outputs["UV"]
        if (texture.offset, texture.rotation, texture.tiling) != ((0.0, 0.0), 0.0, (1.0, 1.0)):
            mapping = self._tree.nodes.new("ShaderNodeMapping")
            (x, y), (_, height), turn = texture.offset, texture.tiling, texture.rotation
            # the file counts from the upper left, Blender from the lower left
            mapping.inputs["Location"].default_value = (x + sin(turn) * height, 1 - y - cos(turn) * height, 0)
            mapping.inputs["Rotation"].default_value = (0, 0, turn)
            mapping.inputs["Scale"].default_value = (*texture.tiling, 1)
            self._tree.links.new(place, mapping.inputs["Vector"])
            place = mapping.outputs["Vector"]
        self._tree.links.new(place, node.inputs["Vector"])
        return node

    def times(self, color: Any, factor: Any) -> Any:
        if tuple(factor) == (1.0, 1.0, 1.0):
            return color
        node = self._tree.nodes.new("ShaderNodeVectorMath")
        node.operation = "MULTIPLY"
        node.inputs[1].default_value = tuple(factor)
        self._tree.links.new(color, node.inputs[0])
        return node.outputs[0]

    def scaled(self, value: Any, factor: float) -> Any:
        if factor == 1.0:
            return value
        node = self._tree.nodes.new("ShaderNodeMath")
        node.operation = "MULTIPLY"
        node.inputs[1].default_value = factor
        self._tree.links.new(value, node.inputs[0])
        return node.outputs[0]


def from_blender(given: list[Any], uv_names: dict[str, str]) -> tuple[tuple[Any, ...], tuple[Any, ...]]:
    """Materials and images of gvpipe, of materials of Blender; what other nodes make of them is lost.

    Args:
        given: Blender's materials.
        uv_names: the attribute of each layer.
    """
    import gvpipe

    images: dict[str, Any] = {}
    made = []
    for material in given:
        nodes = material.node_tree.nodes if material.node_tree else ()
        node = next((each for each in nodes if each.type == "BSDF_PRINCIPLED"), None)
        plain = {"base_color": _limited(material.diffuse_color)}
        values = _principled(node.inputs, images, uv_names) if node else plain
        made.append(gvpipe.Material(material.name, double_sided=not material.use_backface_culling, **values))
    return tuple(made), tuple(images.values())


def _principled(sockets: Any, images: dict[str, Any], uv_names: dict[str, str]) -> dict[str, Any]:
    """Fields of a material, from the sockets of a Principled BSDF."""
    alpha, strength = (float(sockets[name].default_value) for name in ("Alpha", "Emission Strength"))
    values: dict[str, Any] = {
        name: float(sockets[socket].default_value) for socket, name in NUMBERS.items() if not sockets[socket].is_linked
    }
    base, emission = (
        (1.0, 1.0, 1.0) if sockets[name].is_linked else tuple(sockets[name].default_value)[:3]
        for name in ("Base Color", "Emission Color")
    )
    pictures = {"base_color_texture": _picture(sockets["Base Color"])}
    if strength:
        pictures["emissive_texture"] = _picture(sockets["Emission Color"])
        values["emissive"] = tuple(strength * each for each in emission)
    if bump := _before(sockets["Normal"], "NORMAL_MAP"):
        pictures["normal_texture"] = _picture(bump.inputs["Color"])
    if _before(sockets["Metallic"], "SEPARATE_COLOR") and (split := _before(sockets["Roughness"], "SEPARATE_COLOR")):
        pictures["metallic_roughness_texture"] = _picture(split.inputs["Color"])
        values |= {"metallic": 1.0, "roughness": 1.0}
    values["base_color"] = _limited((*base, alpha))
    values["alpha_mode"] = "blend" if alpha < 1 or sockets["Alpha"].is_linked else "opaque"
    textures = {name: _texture(node, images, uv_names) for name, node in pictures.items() if node}
    return values | {name: texture for name, texture in textures.items() if texture}


def _before(socket: Any, kind: str) -> Any:
    """The node of a kind that a socket is linked to, or None."""
    node = socket.links[0].from_node if socket.is_linked else None
    return node if node and node.type == kind else None


def _limited(color: Any) -> tuple[float, ...]:
    return tuple(min(max(float(each), 0.0), 1.0) for each in color)


def _picture(socket: Any) -> Any:
    """The node of an image that a socket shows, through one node between them, or None."""
    for _ in range(3):
        if not socket.is_linked:
            return None
        node = socket.links[0].from_node
        if node.type == "TEX_IMAGE":
            return node if node.image else None
        socket = next((each for each in node.inputs if each.is_linked), None)
        if socket is None:
            return None
    return None


def _texture(node: Any, images: dict[str, Any], uv_names: dict[str, str]) -> Any:
    import gvpipe

    if node.image.name not in images:
        found = _image(node.image)
        if found is None:
            return None
        images[node.image.name] = found
    uv = next(iter(uv_names.values()), "uv")
    if node.inputs["Vector"].is_linked and node.inputs["Vector"].links[0].from_node.type == "UVMAP":
        uv = uv_names.get(node.inputs["Vector"].links[0].from_node.uv_map, uv)
    wrap = next((name for name, mode in WRAPS.items() if mode == node.extension), "clamp")
    return gvpipe.Texture(
        list(images).index(node.image.name),
        uv,
        wrap=(wrap, wrap),
        filter="nearest" if node.interpolation == "Closest" else "linear",
    )


def _image(image: Any) -> Any:
    """The bytes of an image: packed, of its file, or as PNG; None where it has no pixels."""
    import gvpipe

    path = bpy.path.abspath(image.filepath, library=image.library)
    if image.packed_file is not None:
        data = bytes(image.packed_file.data)
    elif image.source == "FILE" and os.path.isfile(path):
        with open(path, "rb") as file:
            data = file.read()
    else:
        data = b""
    media = next((media for head, media in MEDIA if data.startswith(head)), "")
    if not media:
        if not image.size[0]:
            return None
        with tempfile.TemporaryDirectory() as folder:
            file_path = os.path.join(folder, "image.png")
            image.save(filepath=file_path) if image.file_format == "PNG" else image.save_render(file_path)
            with open(file_path, "rb") as file:
                data, media = file.read(), "image/png"
    name = os.path.splitext(image.name)[0]
    return gvpipe.Image(name, media, data)
