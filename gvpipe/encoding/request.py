"""What is asked for: codecs to choose from, and the one target that the file must meet."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gvpipe.captures.tracking import Targets
from gvpipe.coding.codec import Codec
from gvpipe.coding.registry import codec_class, make_codec
from gvpipe.foundation.arguments import show
from gvpipe.foundation.errors import SettingError
from gvpipe.metrics.vertex_errors import frame_diagonal
from gvpipe.model.sequence import MeshSequence
from gvpipe.rate_control.purposes import candidates, check_purpose, check_serves
from gvpipe.rate_control.targets import Target, parse_bound, read_bound

TARGETS = ("target_rmse", "target_kg", "target_bpvf", "max_error")
LAYOUTS = ("stream", "bare")
NO_TARGETS = (None, None, None, None)


@dataclass(frozen=True)
class Request:
    """What was asked for: a codec or some, their settings, a purpose, the values of `TARGETS`, and names of other arguments."""

    codec: str | Codec | Sequence[Codec] | None
    settings: dict[str, Any]
    purpose: str | None
    targets: Targets
    also: tuple[str, ...] = ()

    def candidates(self, default: str | None = None) -> Codec | Sequence[Codec]:
        """The settings object of the codec, or of all to choose from; ``default`` where neither codec nor purpose is given."""
        codec = default if self.codec is None and self.purpose is None else self.codec
        return chosen_codecs(codec, self.settings, self.purpose, self.also)


def check_wanted(values: Sequence[float | str | None], stream: bool, bare: bool) -> None:
    """Refuse more than one target, of `TARGETS`, or layout, and a target that does not go with the layout."""
    if sum(value is not None for value in values) > 1:
        raise SettingError(f"more than one target is given; choose one of {', '.join(TARGETS)}")
    if stream and bare:
        raise SettingError("stream and bare are two layouts; choose one of them")
    if (stream or bare) and values[TARGETS.index("target_bpvf")] is not None:
        raise SettingError("target_bpvf counts the plain layout; encode to it, then change the layout by restream")


def chosen_codecs(
    codec: str | Codec | Sequence[Codec] | None, settings: dict[str, Any], purpose: str | None, also: Iterable[str] = ()
) -> Codec | Sequence[Codec]:
    """The settings object of the one codec that is asked for, or of all to choose from.

    Args:
        codec, purpose: as of `gvpipe.encode`.
        settings: by name.
        also: names that are no settings, but may have been meant.

    Raises:
        SettingError: no such codec, setting or purpose, or settings beside a settings object.
        TypeError: a codec that is none.
    """
    if codec is None or isinstance(codec, str):
        return candidates(codec, purpose, lambda name, own: make_codec(name, {**own, **settings}, also), frozenset(settings))
    given = [codec] if isinstance(codec, Codec) else codec
    if not (isinstance(given, list | tuple) and given) or not all(_is_settings(one) for one in given):
        raise TypeError(f"codec is {show(codec)}; an id such as 'mcgv', a settings object or a list of those is needed")
    check_purpose(purpose)
    for one in given:
        check_serves(one, purpose)
    if settings:
        names = ", ".join(settings)
        raise SettingError(f"{names} beside a settings object; set it there, or give the codec's id and settings by name")
    return codec


def _is_settings(value: object) -> bool:
    return isinstance(value, Codec) and not isinstance(value, type)


def one_target(
    sequence: MeshSequence, rmse: float | None, kg: float | None, bpvf: float | None, bound: float | str | None
) -> Target | None:
    """The one target that is given."""
    for measure, value in (("rmse", rmse), ("kg", kg), ("bpvf", bpvf)):
        if value is not None:
            return Target(measure, value)
    return None if bound is None else Target("max", parse_bound(bound, sequence))


def shot_target(shot: MeshSequence, targets: Targets, diagonal: float) -> Target | None:
    """The target of a shot; parts of a diagonal are of the capture's, model units."""
    rmse, kg, bpvf, bound = targets
    own = frame_diagonal(shot)
    if rmse is not None and own > 0:
        rmse *= diagonal / own
    if bound is not None and read_bound(bound)[1] and own > 0:
        bound = f"{read_bound(bound)[0] * diagonal / own!r}%"
    return one_target(shot, rmse, kg, bpvf, bound)


def knows_settings(codec: str, settings: Mapping[str, Any]) -> bool:
    """Whether a codec has settings of these names."""
    return settings.keys() <= {each.name for each in dataclasses.fields(codec_class(codec))}
