"""What the command line adds on standard error while the library works."""

from __future__ import annotations

import logging

import pytest

from gvpipe.cli.console import COMPILER, Output
from gvpipe.runtime import announcements

LOGGER = logging.getLogger(COMPILER)


@pytest.mark.parametrize(
    ("out", "is_terminal", "is_noted"),
    [
        (Output(), False, False),
        (Output(), True, True),
        (Output(as_json=True), True, True),
        (Output(verbose=True), False, True),
        (Output(quiet=True), True, False),
        (Output(quiet=True, verbose=True), True, False),
    ],
)
def test_compiling_is_noted_where_progress_is_shown(
    out: Output, is_terminal: bool, is_noted: bool, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """On standard error, as one line; nothing listens afterwards."""
    monkeypatch.setattr("sys.stderr.isatty", lambda: is_terminal)
    with out.progress():
        LOGGER.info(announcements.ONCE)
    LOGGER.info(announcements.ONCE)
    printed = capsys.readouterr()
    assert printed.out == "" and " ".join(printed.err.split()).count(f"Note: {announcements.ONCE}") == is_noted
    assert not LOGGER.handlers and LOGGER.level == logging.NOTSET


def test_the_logger_is_that_of_the_compiler() -> None:
    assert announcements.LOGGER is LOGGER
