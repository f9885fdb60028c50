"""Parts that files share: made once, let go of by number and by size."""

from __future__ import annotations

from gvpipe.container.shared_parts import MOST_BYTES, SharedParts


def test_the_last_ones_are_kept() -> None:
    shared, made = SharedParts(2), list[str]()

    def get(name: str, n_bytes: int = 1) -> str:
        return shared("letters", (name.encode() * n_bytes,), lambda: made.append(name) or name)  # type: ignore[func-returns-value]

    assert [get(name) for name in "abacab"] == list("abacab")
    assert made == list("abcb")  # b was the oldest when c came
    get("d", MOST_BYTES), get("e", 1), get("e", 1), get("d", MOST_BYTES)
    assert made == list("abcbded")  # too large beside another
