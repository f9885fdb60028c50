"""Extensions of glTF's materials whose fields a `gvpipe.Material` has: which, and by what names.

A field's name follows from the member's: ``clearcoatRoughnessFactor`` is `clearcoat_roughness`.

Source: Khronos, glTF's registry of extensions.
"""

from __future__ import annotations

import re
from dataclasses import fields
from typing import Any

from gvpipe.asset.material import Material

LAYERS = {
    "KHR_materials_clearcoat": (
        "clearcoatFactor", "clearcoatTexture", "clearcoatRoughnessFactor", "clearcoatRoughnessTexture",
        "clearcoatNormalTexture",
    ),
    "KHR_materials_transmission": ("transmissionFactor", "transmissionTexture"),
    "KHR_materials_volume": ("thicknessFactor", "thicknessTexture", "attenuationDistance", "attenuationColor"),
    "KHR_materials_ior": ("ior",),
    "KHR_materials_specular": ("specularFactor", "specularTexture", "specularColorFactor", "specularColorTexture"),
    "KHR_materials_sheen": ("sheenColorFactor", "sheenColorTexture", "sheenRoughnessFactor", "sheenRoughnessTexture"),
    "KHR_materials_iridescence": (
        "iridescenceFactor", "iridescenceTexture", "iridescenceIor", "iridescenceThicknessMinimum",
        "iridescenceThicknessMaximum", "iridescenceThicknessTexture",
    ),
    "KHR_materials_anisotropy": ("anisotropyStrength", "anisotropyRotation", "anisotropyTexture"),
    "KHR_materials_dispersion": ("dispersion",),
    "KHR_materials_diffuse_transmission": (
        "diffuseTransmissionFactor", "diffuseTransmissionTexture", "diffuseTransmissionColorFactor",
        "diffuseTransmissionColorTexture",
    ),
}  # fmt: skip
STRENGTH, UNLIT = "KHR_materials_emissive_strength", "KHR_materials_unlit"
TAKEN_LOOKS = {*LAYERS, STRENGTH, UNLIT}
DEFAULTS: dict[str, Any] = {field.name: field.default for field in fields(Material)}


def field_name(member: str) -> str:
    """The field of a member.

    Examples:
        >>> field_name("clearcoatRoughnessFactor"), field_name("sheenColorTexture"), field_name("ior")
        ('clearcoat_roughness', 'sheen_color_texture', 'ior')
    """
    return re.sub(r"([A-Z])", r"_\1", member).lower().removesuffix("_factor")
