"""What a user asks of an asset's coding: bounds by name, and a limit of textures."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Self

from gvpipe.asset_coding.bounds import Given
from gvpipe.asset_coding.pictures import TextureLimit


@dataclass(frozen=True)
class AssetOptions:
    """What a user asks of an asset's coding.

    Args:
        attributes, fields: bounds by name (`gvpipe.asset_coding.bounds.precision`); others have the default.
        textures: what images may be.
        spares_volume: whether what lies inside is left out where it costs much (`gvpipe.asset_coding.volume_choice`).
    """

    attributes: Given = field(default_factory=dict)
    fields: Given = field(default_factory=dict)
    textures: TextureLimit = field(default_factory=TextureLimit)
    spares_volume: bool = False

    @classmethod
    def of(cls, attributes: Given | None, fields: Given | None, textures: int | str | None) -> Self:
        """From the arguments of `gvpipe.encode`; raises `SettingError`."""
        return cls(dict(attributes or {}), dict(fields or {}), TextureLimit.parse(textures))


NO_OPTIONS = AssetOptions()
