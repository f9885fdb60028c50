"""Purposes of a file, and the codecs with the settings that serve each.

A codec may compete with several settings (`VARIANTS`). Of a codec that this module does not name, the defaults compete for
archives.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast

from gvpipe.coding.codec import Codec
from gvpipe.coding.registry import codec_class, codec_ids
from gvpipe.foundation.arguments import did_you_mean
from gvpipe.foundation.errors import SettingError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Own = dict[str, Any]  # settings that differ from a codec's defaults

AUTO = "auto"
DEFAULT_CODEC = "mcgv"
WEB, ARCHIVE, STREAM = "web", "archive", "stream"
PURPOSES = (WEB, ARCHIVE, STREAM)
VARIANTS: dict[str, tuple[Own, ...]] = {"mcgv": ({}, {"transform": "klt"})}  # the others: their defaults
SERVES: dict[str, dict[str, Own]] = {  # archive: all
    WEB: {"mcgv": {}},
    STREAM: {"mcgv": {"gop": 16}, "pdct": {"clip": 24}},  # about half a second and a second: what a jump decodes at most
}
NEEDS: dict[str, dict[str, dict[str, Any]]] = {  # settings without which a codec does not serve
    WEB: {"mcgv": {"image": "h264", "profile": "web"}, "laplacian": {}, "pca": {}, "pdct": {}},
    STREAM: {"mcgv": {"transform": "none"}, "pdct": {}},
}
LACKS = {WEB: "browsers do not play", STREAM: "readers cannot start at once with"}


def candidates(
    codec: str | None, purpose: str | None, make: Callable[[str, Own], Codec], given: frozenset[str] = frozenset()
) -> Codec | list[Codec]:
    """Return the settings object of the codec that is asked for, or of all candidates.

    Args:
        codec: its id; ``auto`` for all that serve the purpose; None: ``auto`` where a purpose is given, else ``mcgv``.
        purpose: one of `PURPOSES`, or None, which with ``auto`` is ``archive``.
        make: builds a codec's settings object from its id and settings; settings of the user override these.
        given: names of the user's settings.

    Raises:
        SettingError: no such codec or purpose; what is asked for does not serve the purpose; what ``make`` raises.
    """
    check_purpose(purpose)
    codec = codec or (AUTO if purpose else DEFAULT_CODEC)
    if codec != AUTO:
        served = SERVES.get(purpose or ARCHIVE, {})
        one = make(codec, _without(served.get(codec, {}), given))
        check_serves(one, purpose)
        return one
    made = [make(name, _without(own, given)) for name, own in _competitors(purpose)]
    for one in made:
        check_serves(one, purpose)
    return made


def check_purpose(purpose: str | None) -> None:
    """Raise `SettingError` unless ``purpose`` is None or one of `PURPOSES`."""
    if purpose is not None and purpose not in PURPOSES:
        raise SettingError(f"purpose is {purpose!r}; one of {', '.join(PURPOSES)} is needed{did_you_mean(purpose, PURPOSES)}")


def check_serves(codec: Codec, purpose: str | None) -> None:
    """Raise `SettingError` if a file with these settings does not serve the purpose."""
    if purpose is None or purpose == ARCHIVE:
        return
    needs = NEEDS[purpose]
    if codec.id not in needs:
        raise SettingError(
            f"{LACKS[purpose]} codec {codec.id}; for {purpose} leave the codec out, or take {' or '.join(needs)}"
        )
    settings = dataclasses.asdict(cast("DataclassInstance", codec))
    for name, value in needs[codec.id].items():
        if settings[name] != value:
            raise SettingError(f"{LACKS[purpose]} {codec.id} with {name} {settings[name]}; for {purpose} take {name} {value}")


def _competitors(purpose: str | None) -> list[tuple[str, Own]]:
    """Ids with settings of their own."""
    if purpose is None or purpose == ARCHIVE:
        return [(name, own) for name in codec_ids() if codec_class(name).competes for own in VARIANTS.get(name, ({},))]
    return list(SERVES[purpose].items())


def _without(own: Own, given: frozenset[str]) -> Own:
    return {name: value for name, value in own.items() if name not in given}


def describe(codec: Codec) -> str:
    """Return a codec's id, with the settings that distinguish it from its other variants: ``mcgv transform=klt``."""
    names = {name for own in VARIANTS.get(codec.id, ()) for name in own}
    return name_with(codec.id, {name: value for name, value in own_settings(codec).items() if name in names})


def own_settings(codec: Codec) -> Own:
    """Return the settings that differ from the codec's defaults, the quality left out, by name."""
    fields = dataclasses.fields(cast("DataclassInstance", codec))
    values = {field.name: getattr(codec, field.name) for field in fields}
    return {
        field.name: values[field.name] for field in fields if values[field.name] != field.default and field.name != "quality"
    }


def name_with(codec_id: str, settings: Own) -> str:
    """Return a codec's id with settings.

    Examples:
        >>> name_with("mcgv", {"transform": "klt"})
        'mcgv transform=klt'
    """
    return " ".join([codec_id, *(f"{name}={value}" for name, value in sorted(settings.items()))])
