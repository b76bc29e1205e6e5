"""Screenshots and a film of ``dreamdrive view`` in headless Chromium: ``docs/film.py OUT --to DIR``."""

import argparse
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from playwright.sync_api import Page, sync_playwright

from dreamdrive.data.pictures.video_writer import write_video
from dreamdrive.stored import load_scene

SIZE = {"width": 1280, "height": 720}
FILM = (960, 540)
FPS = 8.0
QUALITY = 80
_BY_THE_CPU = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]
_REST_MS, _STEP_MS, _PATIENCE_MS = 4000, 100, 240_000


def main() -> None:
    """Open the page on a scene, and show what can be done with it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path, help="folder of generate, with something that moves")
    parser.add_argument("--to", type=Path, default=Path("docs/images"))
    parser.add_argument("--seconds", type=float, default=15.0, help="of the film; 0 is none")
    asked = parser.parse_args()
    command = [
        shutil.which("dreamdrive") or "dreamdrive",
        "view",
        str(asked.out),
        "--port",
        "0",
        "-o",
        "/tmp",
    ]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        found = re.search(r"http://\S+", process.stdout.readline())
        assert found is not None, "the page did not open"
        with sync_playwright() as playwright:
            path = shutil.which("chromium")
            browser = playwright.chromium.launch(executable_path=path, args=_BY_THE_CPU)
            page = browser.new_page(viewport=SIZE)  # type: ignore[arg-type]
            page.set_default_timeout(_PATIENCE_MS)
            page.goto(found[0])
            page.get_by_role("button", name="Play").wait_for()
            page.wait_for_timeout(3 * _REST_MS)
            page.locator("[role=alert] button").first.click()  # that a core draws, which is known
            _stills(page, asked)
            if asked.seconds:
                write_video(asked.to / "view.mp4", _film(page, asked), FPS)
            browser.close()
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(30)


def _stills(page: Page, asked: argparse.Namespace) -> None:
    """Screenshots of an actor that is picked and painted, and of a path."""
    _choose(page, "Actor", re.compile(rf"^{_ahead(asked.out)}:"))
    page.get_by_role("button", name="Paint").click()
    page.wait_for_timeout(2 * _REST_MS)
    page.get_by_text("Time", exact=True).scroll_into_view_if_needed()
    _shot(page, asked.to / "view_actor.jpg")
    page.get_by_role("button", name="Undo").click()
    _choose(page, "Actor", "none")
    page.get_by_role("checkbox", name="Click on the road").check(force=True)
    for x, y in ((330, 600), (430, 480), (500, 415)):
        page.mouse.click(x, y)
        page.wait_for_timeout(_REST_MS)
    page.wait_for_timeout(_REST_MS)
    _shot(page, asked.to / "view_path.jpg")


def _film(page: Page, asked: argparse.Namespace) -> Iterator[np.ndarray]:
    """Pictures of the recorded drive, of depth, and of the drive along the path."""
    share = round(asked.seconds * FPS / 3)
    page.get_by_role("button", name="Play").click()
    yield from _frames(page, share)
    _choose(page, "Layer", "depth")
    yield from _frames(page, share)
    _choose(page, "Layer", "colour")
    _choose(page, "Camera", "path")
    yield from _frames(page, share)


def _ahead(out: Path) -> int:
    """The actor that the first view shows nearest to its middle."""
    scene = load_scene(out / "scene")
    assert scene.actors, f"nothing moves in {out}"
    seen = scene.cameras[0].project(np.stack([actor.track.positions_m[0] for actor in scene.actors]))
    aside = np.where(seen[:, 2] > 0, np.abs(seen[:, 0] - scene.cameras[0].cx_px), np.inf)
    return scene.actors[int(np.argmin(aside))].id


def _choose(page: Page, label: str, option: "str | re.Pattern[str]") -> None:
    page.get_by_role("combobox", name=label).click()
    page.get_by_role("option", name=option).click()
    page.wait_for_timeout(_REST_MS // 4)


def _frames(page: Page, count: int) -> Iterator[np.ndarray]:
    for _ in range(count):
        page.wait_for_timeout(_STEP_MS)
        taken = np.frombuffer(page.screenshot(type="jpeg", quality=90), np.uint8)
        picture = cv2.imdecode(taken, cv2.IMREAD_COLOR)
        small = cv2.resize(picture, FILM, interpolation=cv2.INTER_AREA)
        yield np.ascontiguousarray(small[:, :, ::-1])


def _shot(page: Page, place: Path) -> None:
    place.write_bytes(page.screenshot(type="jpeg", quality=QUALITY))


if __name__ == "__main__":
    sys.exit(main())
