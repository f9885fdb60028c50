"""What lies beside positions, for positions that are coded anew for browsers."""

from __future__ import annotations

import dataclasses

from gvpipe.asset_coding.directory import SECTION, pack_directory, unpack_directory
from gvpipe.asset_coding.encoder import AssetCoder
from gvpipe.asset_coding.options import AssetOptions
from gvpipe.coding.codec import Codec, Encoded
from gvpipe.container.bitstream import Bitstream
from gvpipe.playback.player import Player


def carry_asset(player: Player, encoded: Encoded, codec: Codec) -> Bitstream:
    """What a conversion made of a video's positions, with the video's asset.

    Attributes keep the bounds that they have in the file. Those of directions and of fields are added to the file's own.
    Normals of frames are left out: the player computes them.
    """
    attributes = {each.name: each.bound or "exact" for each in player.directory.attributes if each.name in player.attributes}
    shown = {name: field for name, field in player.fields.items() if field.kind != "normal"}
    fields = {each.name: f"{each.bound or 'exact'},nan=keep" for each in player.directory.fields if each.name in shown}
    sequence = dataclasses.replace(player.sequence(), fields=shown)
    bitstream = AssetCoder(sequence, AssetOptions.of(attributes, fields, None)).add(encoded, codec)
    if not shown:
        return bitstream
    directory = unpack_directory(bitstream.section(SECTION), bitstream.n_vertices)
    listed = tuple(dataclasses.replace(each, bound=2 * each.bound) for each in directory.fields)
    section = pack_directory(dataclasses.replace(directory, fields=listed), bitstream.n_vertices)
    return dataclasses.replace(bitstream, sections={**bitstream.sections, SECTION: section})
