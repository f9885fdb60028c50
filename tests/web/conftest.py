"""A server with both pages, and a browser that opens them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import browsers
import pages
import pytest
from pages import run


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    """A folder with both pages and both bundles, and its address."""
    folder = tmp_path_factory.mktemp("site")
    pages.write_pages(folder)
    with browsers.served(folder) as address:
        yield folder, address


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with browsers.browser("chromium", tmp_path_factory.mktemp("profile")) as driver:
        yield driver


@pytest.fixture
def module(browser: Any, site: tuple[Path, str]) -> Callable[..., Any]:
    """``module(body, *arguments)`` runs an asynchronous function's body in a page that has imported the module."""
    browser.get(f"{site[1]}/module.html")
    return lambda body, *arguments: run(browser, body, *arguments)


@pytest.fixture
def player(browser: Any, site: tuple[Path, str]) -> Callable[..., Any]:
    """The same in a page with a player, which is `element` there."""
    browser.get(f"{site[1]}/player.html")
    return lambda body, *arguments: run(browser, "const element = document.querySelector('geometry-video');" + body, *arguments)
