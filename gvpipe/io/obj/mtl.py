"""Material files of OBJ, read into metallic-roughness materials.

| statement | becomes |
| --- | --- |
| ``Kd``, ``d`` or ``Tr`` | base color; blending where it is not opaque |
| ``map_Kd`` | base color texture; ``map_d`` with the same picture: blending |
| ``Ke``, ``map_Ke`` | emissive color and texture |
| ``Pm``, ``Pr``, else ``Ns`` | metallic, roughness: 1 - sqrt(Ns / 1000), as Blender has it |
| ``map_Pr -imfchan g``, ``map_Pm -imfchan b`` of one picture | metallic-roughness texture |
| ``norm``, else ``map_Bump`` or ``bump`` | normal texture; ``-bm`` is its scale |
| ``Pc``, ``Pcr``, ``Ps``, ``aniso``, ``anisor`` | clear coat and its roughness, sheen, anisotropy and its rotation |
| ``Ni`` above 1 | index of refraction; many programs write 1, which light passes straight, and mean none |
| ``-o``, ``-s``, ``-clamp on`` of a map | offset, tiling, wrap |

Whatever else a material says is named among what is not carried, if it says anything. ``Ka`` does not (no light of today's
renderers is ambient), nor do grey ``Ks``, a ``map_Ka`` that shows the picture of ``map_Kd``, the usual ``illum`` of 1 or 2, and
options that have their default.

Sources: Wavefront, "Advanced Visualizer" manual, appendix B1 (MTL); the PBR extension after Clara.io's documentation.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

from gvpipe.asset.material import Material, Texture
from gvpipe.io.pictures import Pictures

NUMBERS = {"-o": 3, "-s": 3, "-t": 3, "-mm": 2}  # options with up to so many numbers; others have one word
WORDS = ("-blendu", "-blendv", "-boost", "-cc", "-clamp", "-imfchan", "-texres", "-bm", "-type", "-colorspace")
ALIASES = {"bump": "map_bump", "map_tr": "map_d", "map_ns": "map_Ns"}
KNOWN = {  # statements that are read
    "kd", "d", "tr", "ke", "ns", "pm", "pr", "pc", "pcr", "ps", "aniso", "anisor", "ni", "ka",
}  # fmt: skip
# other statements, and what they say then
SAYS_NOTHING = {"tf": ("1",), "illum": ("1", "2"), "sharpness": ("60",)}
DEFAULTS = {
    "-mm": (0.0, 1.0), "-t": (0.0,), "-blendu": ("on",), "-blendv": ("on",), "-boost": (0.0,), "-cc": ("off",),
}  # fmt: skip


@dataclass(frozen=True)
class _Map:
    """A map statement: its picture, and its options by name."""

    picture: str
    options: dict[str, list[str]]

    @property
    def file(self) -> str:
        """The picture's path in one spelling."""
        return self.picture.replace("\\", "/").lower()

    def numbers(self, option: str, default: float) -> list[float]:
        """Three numbers of ``-o`` or ``-s``."""
        given = [_number(word, default) for word in self.options.get(option, [])]
        return given + [default] * (3 - len(given))

    def word(self, option: str, default: str) -> str:
        """The word of an option."""
        return next(iter(self.options.get(option, [])), default)


def read_mtl(text: str, pictures: Pictures, names: Collection[str]) -> list[Material]:
    """The materials of these names in the file's order; their pictures, and notes, are added to ``pictures``."""
    return [_material(name, statements, pictures) for name, statements in _blocks(text) if name in names]


def names_in(text: str) -> list[str]:
    """The names of all materials in the file's order."""
    return [name for name, _ in _blocks(text)]


def _blocks(text: str) -> list[tuple[str, dict[str, str]]]:
    """Names of materials, and their statements."""
    blocks: list[tuple[str, dict[str, str]]] = []
    for line in text.replace("\\\n", " ").splitlines():
        words = line.strip().split(None, 1)
        if not words or words[0].startswith("#"):
            continue
        key, rest = words[0].lower(), words[1].strip() if len(words) > 1 else ""
        if key == "newmtl":
            blocks.append((rest, {}))
        elif blocks:
            blocks[-1][1][ALIASES.get(key, key)] = rest
    return blocks


def _material(name: str, statements: dict[str, str], pictures: Pictures) -> Material:
    maps = {key: _map(rest) for key, rest in statements.items() if key.startswith("map_") or key == "norm"}
    base, opacity = maps.get("map_kd"), maps.get("map_d")
    alpha = _number(statements.get("d", "").split("-halo")[-1], 1 - _number(statements.get("tr", ""), 0))
    color = _color(statements.get("kd", ""), 1.0)
    if base and not any(color):
        color = (1.0, 1.0, 1.0)  # some programs write black beside a picture, and mean the picture
    is_cut_out = base is not None and opacity is not None and base.file == opacity.file
    emissive = _color(statements.get("ke", ""), 0.0)
    if "map_ke" in maps and not any(emissive):
        emissive = (1.0, 1.0, 1.0)
    sheen = _number(statements.get("ps", ""), 0)
    others = {key: rest for key, rest in statements.items() if key not in maps and key not in KNOWN}
    pictures.left.add_all(f"material statement {key}" for key, rest in others.items() if _says(key, rest))
    refraction = _number(statements.get("ni", ""), Material.ior)
    shine = min(max(_number(statements.get("ns", ""), 0), 0), 1000)
    normal = maps.get("norm") or maps.get("map_bump")
    packed = _packed(maps.get("map_pr"), maps.get("map_pm"))
    used = {"map_kd", "map_ke", "norm" if "norm" in maps else "map_bump"}
    used |= ({"map_d"} if is_cut_out else set()) | ({"map_pr", "map_pm"} if packed else set())
    shown = maps["map_kd"].file if "map_kd" in maps else ""
    lost = [key for key, one in maps.items() if key not in used and one.picture and (key, one.file) != ("map_ka", shown)]
    pictures.left.add_all(f"material statement {key}" for key in lost)
    for key, one in maps.items():
        if key in used and one.picture:
            scaled = one is normal
            pictures.left.add_all(f"option {option} of {key}" for option in _left_options(one, scaled))
    return Material(
        name,
        (*color, min(max(alpha, 0.0), 1.0)),
        _texture(base, name, pictures),
        _number(statements.get("pm", ""), 0),
        _number(statements.get("pr", ""), 1 - math.sqrt(shine / 1000)),
        _texture(packed, name, pictures),
        _texture(normal, name, pictures, _number(normal.word("-bm", "1"), 1) if normal else 1.0),
        emissive=emissive,
        emissive_texture=_texture(maps.get("map_ke"), name, pictures),
        alpha_mode="blend" if alpha < 1 or is_cut_out else "opaque",
        clearcoat=_number(statements.get("pc", ""), 0),
        clearcoat_roughness=_number(statements.get("pcr", ""), 0),
        sheen_color=(sheen, sheen, sheen),
        anisotropy_strength=_number(statements.get("aniso", ""), 0),
        anisotropy_rotation=2 * math.pi * _number(statements.get("anisor", ""), 0),
        ior=refraction if refraction > 1 else Material.ior,
    )


def _says(key: str, rest: str) -> bool:
    """Whether a statement without a counterpart says anything."""
    if key == "ks":
        return len(set(_color(rest, 0.0))) > 1
    nothing = SAYS_NOTHING.get(key, ())
    words = [f"{_number(word, -1):g}" for word in rest.split()]
    return not words or any(word not in nothing for word in words)


def _left_options(one: _Map, is_normal: bool) -> list[str]:
    """Options of a map that are not read and say something: colour ranges, turbulence, blending, third numbers, bump scale."""
    left = []
    for option, words in one.options.items():
        plain = DEFAULTS.get(option)
        if option in ("-o", "-s"):
            says = len(words) > 2 and _number(words[2], 0) != (option == "-s")
        elif option == "-bm":
            says = not is_normal and _number(" ".join(words), 1) != 1
        elif plain is None:  # of the picture's channels, size and kind
            says = option in ("-type", "-texres")
        elif isinstance(plain[0], str):
            says = words != list(plain)
        else:
            given = [_number(word, 0) for word in words]
            says = given != list(plain[: len(given)]) and any(given)
        left += [option] if says else []
    return left


def _map(rest: str) -> _Map:
    """Options, then a file name that may have blanks."""
    options: dict[str, list[str]] = {}
    while rest.startswith("-"):
        option, _, rest = rest.partition(" ")
        key, most = option.lower(), NUMBERS.get(option.lower(), 1)
        if key not in NUMBERS and key not in WORDS:
            return _Map(f"{option} {rest}".strip(), options)  # a file name that starts with a hyphen
        options[key] = []
        rest = rest.lstrip()
        while len(options[key]) < most:
            word, _, after = rest.partition(" ")
            if not word or (key in NUMBERS and not _is_number(word)):
                break
            options[key].append(word)
            rest = after.lstrip()
    return _Map(rest.strip().strip('"'), options)


def _packed(roughness: _Map | None, metallic: _Map | None) -> _Map | None:
    """The map of both, if they are two channels of one picture as glTF has them."""
    if roughness is None or metallic is None or roughness.file != metallic.file:
        return None
    channels = roughness.word("-imfchan", "").lower(), metallic.word("-imfchan", "").lower()
    return roughness if channels == ("g", "b") else None


def _texture(one: _Map | None, material: str, pictures: Pictures, scale: float = 1.0) -> Texture | None:
    number = pictures.find(one.picture, material) if one and one.picture else None
    if one is None or number is None:
        return None
    wrap = "clamp" if one.word("-clamp", "off").lower() == "on" else "repeat"
    (u, v, _), (su, sv, _) = one.numbers("-o", 0.0), one.numbers("-s", 1.0)
    # v' = v + sv * coordinate from below; from above that is (1 - v - sv) + sv * coordinate
    return Texture(number, "uv", scale, (wrap, wrap), offset=(u, round(1 - v - sv, 12) + 0.0), tiling=(su, sv))


def _color(rest: str, default: float) -> tuple[float, float, float]:
    """Three numbers; one stands for all. Spectral curves and XYZ are not read."""
    numbers = [_number(word, default) for word in rest.split()[:3] if _is_number(word)]
    if not numbers:
        return (default, default, default)
    red = numbers[0]
    return (red, numbers[1], numbers[2]) if len(numbers) == 3 else (red, red, red)


def _number(word: str, default: float) -> float:
    """A finite number, or the default."""
    return float(word) if _is_number(word) else float(default)


def _is_number(word: str) -> bool:
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False
