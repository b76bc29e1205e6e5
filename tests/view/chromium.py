"""A browser for the tests of the page: Debian's Chromium, driven by Playwright."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, sync_playwright

NEEDED = "DREAMDRIVE_PAGE"
"""Set by ``.ci/page``: then a missing browser is a failure."""
_NAMES = ("chromium", "chromium-browser", "google-chrome")
_BY_THE_CPU = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox")


def executable() -> str:
    """Where the browser is; without one the test is skipped, or fails where it was asked for."""
    found = next((path for name in _NAMES if (path := shutil.which(name))), None)
    if found is None:
        said = "there is no Chromium; install it (Debian: apt-get install chromium), or run make page as root"
        if os.environ.get(NEEDED):
            pytest.fail(said)
        pytest.skip(said)
    return found


@contextmanager
def browser() -> Iterator[Browser]:
    """Headless, without a graphics card."""
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=executable(), args=list(_BY_THE_CPU))
        try:
            yield opened
        finally:
            opened.close()


def shoot(page: Page, name: str) -> None:
    """A screenshot, kept where ``DREAMDRIVE_SHOTS`` names a folder."""
    if folder := os.environ.get("DREAMDRIVE_SHOTS"):
        page.screenshot(path=str(Path(folder) / f"{name}.png"))
