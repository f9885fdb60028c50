"""What lies beside positions, in files for browsers: all as it is, but fields in the coding of the web player.

The coding of `gvpipe.fields` takes far fewer bytes, but a decoder too large for a page. So fields are decoded, and coded again
by `gvpipe.web.field_export`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from gvpipe.arrays import Int32
from gvpipe.asset.field import Field
from gvpipe.asset_coding.directory import SECTION, Listed, pack_directory, unpack_directory
from gvpipe.asset_coding.encoder import AssetCoder, FieldCoding
from gvpipe.asset_coding.options import AssetOptions
from gvpipe.codec import Codec, Encoded
from gvpipe.container.bitstream import Bitstream
from gvpipe.player import Player
from gvpipe.web.field_export import CODING, encode_web_field


def with_web_fields(player: Player) -> Bitstream:
    """A video's bitstream with its fields as the web player reads them; the same object if there is none to be coded."""
    bitstream = player.bitstream
    if not player.fields:
        return bitstream
    shown = shown_fields(player.fields)
    directory = unpack_directory(bitstream.section(SECTION), bitstream.n_vertices)
    sections = dict(bitstream.sections)
    listed = []
    for each in directory.fields:
        if each.name in shown:
            sections[each.section], own = _code_again(each, shown[each.name], player.faces)
            listed.append(own)
        elif each.name in player.fields:
            del sections[each.section]
        else:
            listed.append(each)
    sections[SECTION] = pack_directory(dataclasses.replace(directory, fields=tuple(listed)))
    return dataclasses.replace(bitstream, sections=sections)


def carry_asset(player: Player, encoded: Encoded, codec: Codec) -> Bitstream:
    """What a conversion made of a video's positions, with the video's asset.

    Attributes keep the bounds that they have in the file. Those of directions are added to the file's own.
    """
    directory = player.directory
    attributes = {each.name: each.bound or "exact" for each in directory.attributes if each.name in player.attributes}
    shown = shown_fields(player.fields)
    fields = {each.name: f"{each.bound or 'exact'},nan=keep" for each in directory.fields if each.name in shown}
    coder = AssetCoder(
        dataclasses.replace(player.sequence(), fields=shown),
        AssetOptions.of(attributes, fields, None),
        FieldCoding(CODING, _encode),
    )
    return coder.add(encoded, codec)


def shown_fields(fields: Mapping[str, Field]) -> dict[str, Field]:
    """Those that the player shows: it computes normals itself."""
    return {name: field for name, field in fields.items() if field.kind != "normal"}


def _code_again(listed: Listed, field: Field, faces: Int32) -> tuple[bytes, Listed]:
    coded = encode_web_field(field, faces, listed.bound)
    bound = listed.bound + coded.bound  # the file's own error is still there
    return coded.data, dataclasses.replace(listed, coding=CODING, bound=bound, range=coded.range)


def _encode(field: Field, faces: Int32, bound: float) -> tuple[bytes, float]:
    coded = encode_web_field(field, faces, bound)
    return coded.data, bound + coded.bound
