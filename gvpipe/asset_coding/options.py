"""What a user asks of an asset's coding: bounds by name, and a limit of textures."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Self

from gvpipe.asset_coding.bounds import Given
from gvpipe.asset_coding.moving_textures import MovingCoding
from gvpipe.asset_coding.pictures import TextureLimit


@dataclass(frozen=True)
class AssetOptions:
    """What a user asks of an asset's coding.

    Args:
        attributes, fields: bounds by name (`gvpipe.asset_coding.bounds.precision`); others have the default.
        textures: what images may be.
        moving: how moving images are coded.
        spares_volume: whether what lies inside is left out where it costs much (`gvpipe.asset_coding.volume_choice`).
    """

    attributes: Given = field(default_factory=dict)
    fields: Given = field(default_factory=dict)
    textures: TextureLimit = field(default_factory=TextureLimit)
    moving: MovingCoding = field(default_factory=MovingCoding)
    spares_volume: bool = False

    @classmethod
    def of(
        cls,
        attributes: Given | None,
        fields: Given | None,
        textures: int | str | None,
        moving: MovingCoding | None = None,
    ) -> Self:
        """From the arguments of `gvpipe.encode`; raises `SettingError`."""
        return cls(dict(attributes or {}), dict(fields or {}), TextureLimit.parse(textures), moving or MovingCoding())


NO_OPTIONS = AssetOptions()
