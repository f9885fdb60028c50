"""Characters that no terminal and no page should be sent, and the length that a text of a file may have."""

from __future__ import annotations

import unicodedata

MAX_TEXT = (1 << 16) - 1  # code units of UTF-16
UNSHOWN = ("Cc", "Cs", "Zl", "Zp")  # Unicode's categories: control characters, lone surrogates, separators of lines
TURNING = frozenset(map(chr, (*range(0x202A, 0x202F), *range(0x2066, 0x206A))))  # they turn the direction of writing round
LINES = frozenset("\n\t")  # what a text of several lines may have


def is_unshown(character: str) -> bool:
    """Whether a character may change how what is around it is shown."""
    return unicodedata.category(character) in UNSHOWN or character in TURNING


def escaped(text: str, has_lines: bool = False) -> str:
    """A text with unshown characters as Python writes them, and white space among them as a space.

    Examples:
        >>> escaped("two\\nlines and a bell\\a"), escaped("two\\nlines", has_lines=True)
        ('two lines and a bell\\\\x07', 'two\\nlines')
    """
    if text.isprintable():
        return text
    return "".join(each if has_lines and each in LINES else _shown(each) for each in text)


def text_fault(text: str, has_lines: bool = False) -> str:
    """What a file may not hold of a text, in a few words; nothing for a sound one."""
    if len(text) > MAX_TEXT // 2 and _n_units(text) > MAX_TEXT:
        return f"has more than {MAX_TEXT} characters"
    if text.isprintable():
        return ""
    found = next((each for each in text if is_unshown(each) and not (has_lines and each in LINES)), None)
    return "" if found is None else f"has the character U+{ord(found):04X}, which is not shown"


def cut_text(text: str) -> str:
    """A text cut to the length that a file may hold."""
    if _n_units(text) <= MAX_TEXT:
        return text
    return text.encode("utf-16-le", "surrogatepass")[: 2 * MAX_TEXT].decode("utf-16-le", "ignore")


def _n_units(text: str) -> int:
    return len(text.encode("utf-16-le", "surrogatepass")) // 2


def _shown(character: str) -> str:
    if not is_unshown(character):
        return character
    return " " if character.isspace() else character.encode("unicode_escape").decode("ascii")
