"""A page in Debian's Chromium, without a screen and without a graphics card."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from shutil import which

import pytest
from playwright.sync_api import Page, ViewportSize, sync_playwright

_IN_SOFTWARE = "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"
_LONGEST_MS = 120_000


@contextmanager
def opened(file: Path, fragment: str, size: tuple[int, int]) -> Generator[Page, None, None]:
    """The page of a file, opened from disk; what it asks of the network, and its errors, fail the test."""
    chromium = which("chromium")
    if chromium is None:
        pytest.skip("chromium is not installed")
    wrong: list[str] = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox", *_IN_SOFTWARE])
        width, height = size
        viewport: ViewportSize = {"width": width, "height": height}
        # Waiting is done by eval, which the page forbids itself.
        page = browser.new_page(viewport=viewport, device_scale_factor=1, bypass_csp=True)
        page.set_default_timeout(_LONGEST_MS)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("console", lambda said: wrong.append(said.text) if said.type == "error" else None)
        page.on("request", lambda asked: None if asked.url.startswith("file:") else wrong.append(asked.url))
        page.goto(f"{file.as_uri()}#{fragment}")
        page.wait_for_function("window.dreamdrive || document.getElementById('said').textContent")
        assert page.inner_text("#said") == ""
        yield page
        browser.close()
    assert wrong == []
