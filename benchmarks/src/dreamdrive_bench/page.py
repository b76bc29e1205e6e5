"""The page of ``dreamdrive view`` in headless Chromium: pictures a second, screenshots, a film.

    python -m dreamdrive_bench page OUT --images docs/images --json benchmarks/results/page.json

Pictures are counted where they arrive, while the camera turns: at a socket that draws nothing, as if the
browser ran on another machine or on a graphics card; and in browsers of two sizes that share the cores, which
draw their lines, too. In the film what takes long is shown faster.
"""

import base64
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
from jaxtyping import Float
from playwright.sync_api import Browser, Error, Page, WebSocket, sync_playwright
from websockets import Subprotocol
from websockets.sync.client import connect

from dreamdrive.files.output import new_file
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.scene import Scene
from dreamdrive.show import Image
from dreamdrive.stored import load_scene
from dreamdrive_bench import film
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.markdown import grid
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish

WINDOWS = ((480, 270), (1280, 720))
TURNED_S = 10.0
"""For so long the camera is turned."""
_JPEG = b"\xff\xc0\x00\x11\x08"
"""What comes before height and width in a picture of three colours."""
_SHOWN = (640, 360)
_BY_THE_CPU = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]
_REST_MS, _PATIENCE_MS = 2500, 240_000


@dataclass
class Stream:
    """The pictures that arrived: when, and how many pixels they have across."""

    arrived_s: list[float] = field(default_factory=list[float])
    across_px: list[int] = field(default_factory=list[int])

    def hear(self, socket: WebSocket) -> None:
        """Heed a browser's socket from now on."""
        socket.on("framereceived", self.take)

    def since(self, begun_s: float) -> dict[str, Any]:
        """Pictures a second from one second after the begin on, and their size."""
        moving = [px for s, px in zip(self.arrived_s, self.across_px, strict=True) if begun_s + 1 < s]
        return {"pictures_s": len(moving) / (TURNED_S - 1), "across_px": float(np.median(moving))}

    def take(self, message: str | bytes) -> None:
        """A message that came."""
        start = message.find(_JPEG) if isinstance(message, bytes) else -1
        if isinstance(message, bytes) and start >= 0:
            self.arrived_s.append(time.monotonic())
            self.across_px.append(int.from_bytes(message[start + 7 : start + 9]))


def main() -> int:
    """Measure, show, write."""
    parser = parser_of(__doc__, markdown=True)
    parser.add_argument("out", type=Path, help="folder of generate, with something that moves")
    parser.add_argument("--images", type=Path, metavar="DIR", help="where screenshots and film go")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, chromium() as browser:
        desk = Path(folder)
        with started(args.out, desk) as address:
            rates = [alone(address, WINDOWS[0])]
            rates += [turned(browser, address, window) for window in WINDOWS]
            if args.images:
                shown(browser, address, load_scene(args.out / "scene"), desk, args.images)
    rows = [["window", "pictures/s", "across, px"]]
    rows += [[row["window"], f"{row['pictures_s']:.1f}", f"{row['across_px']:.0f}"] for row in rates]
    return publish(args, {"machine": describe_machine(), "rows": rates}, grid(rows), ())


@contextmanager
def started(out: Path, desk: Path) -> Iterator[str]:
    """The command at work, and its address."""
    command = [shutil.which("dreamdrive") or "dreamdrive", "view", str(out), "--port", "0", "-o", str(desk)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        found = re.search(r"http://\S+", process.stdout.readline())
        assert found is not None, "the page did not open"
        yield found[0]
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(30)


@contextmanager
def chromium() -> Iterator[Browser]:
    """Debian's, headless and without a graphics card."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=_BY_THE_CPU)
        yield browser
        browser.close()


def opened(browser: Browser, address: str, window: tuple[int, int], stream: Stream) -> Page:
    """A page that has come to rest."""
    page = browser.new_page(viewport={"width": window[0], "height": window[1]})
    page.set_default_timeout(_PATIENCE_MS)
    page.on("websocket", stream.hear)
    page.goto(address)
    page.get_by_role("button", name="Play").wait_for(state="attached")
    page.locator("[role=alert] button").first.click()  # that a core draws, which is known
    page.wait_for_timeout(2 * _REST_MS)
    return page


def turned(browser: Browser, address: str, window: tuple[int, int]) -> dict[str, Any]:
    """Pictures a second while the mouse turns the camera."""
    stream = Stream()
    page = opened(browser, address, window, stream)
    x, y = 0.2 * window[0], 0.2 * window[1]  # in the sky: what is clicked would be picked
    page.mouse.move(x, y)
    page.mouse.down()
    begun_s = time.monotonic()
    while (now_s := time.monotonic() - begun_s) < TURNED_S:
        page.mouse.move(x + 0.05 * window[0] * np.sin(3 * now_s), y + 0.05 * window[1] * np.cos(3 * now_s))
        page.wait_for_timeout(10)
    page.mouse.up()
    page.close()
    return {"window": f"{window[0]}x{window[1]}, browser beside", **stream.since(begun_s)}


def alone(address: str, window: tuple[int, int]) -> dict[str, Any]:
    """Pictures a second at a socket that tells of a camera that turns, thirty times a second."""
    stream = Stream()
    protocol = Subprotocol(f"viser-v{version('viser')}")
    with connect(address.replace("http", "ws", 1), subprotocols=[protocol], max_size=None) as socket:
        begun_s = time.monotonic()
        while (now_s := time.monotonic() - begun_s) < TURNED_S:
            socket.send(_camera_message(0.2 * np.sin(3 * now_s), window))
            until_s = time.monotonic() + 1 / 30
            while (left_s := until_s - time.monotonic()) > 0:
                with suppress(TimeoutError):
                    stream.take(socket.recv(left_s))
    return {"window": f"{window[0]}x{window[1]}, browser elsewhere", **stream.since(begun_s)}


def _camera_message(right_rad: float, window: tuple[int, int]) -> bytes:
    """What a browser tells of its camera, which looks ahead from the origin."""
    ahead = [float(np.sin(right_rad)), 0.0, float(np.cos(right_rad))]
    message = {
        "type": "ViewerCameraMessage",
        "wxyz": [float(np.cos(right_rad / 2)), 0.0, float(np.sin(right_rad / 2)), 0.0],
        "position": [0.0, 0.0, 0.0],
        "fov": 0.8,
        "near": 0.1,
        "far": 1000.0,
        "image_width": window[0],
        "image_height": window[1],
        "look_at": ahead,
        "up_direction": [0.0, -1.0, 0.0],
    }
    return msgspec.msgpack.encode(message)


def shown(browser: Browser, address: str, scene: Scene, desk: Path, images: Path) -> None:
    """What can be done with the page, filmed; and two screenshots."""
    page = opened(browser, address, WINDOWS[-1], Stream())
    page.wait_for_timeout(4 * _REST_MS)  # until the notice has faded
    frames = filmed(page, 3.0, lambda: _play(page, scene))
    frames += filmed(page, 3.0, lambda: _drag(page, scene))
    _shot(page, images / "view_actor.jpg")
    frames += filmed(page, 2.0, lambda: _layers(page))
    frames += filmed(page, 3.0, lambda: _path(page))
    _shot(page, images / "view_path.jpg")
    frames += filmed(page, 2.5, lambda: _along(page, scene))
    frames += filmed(page, 1.5, lambda: _render(page, desk))
    film.write(images / "view.webp", frames)


def filmed(page: Page, seconds: float, act: Callable[[], None]) -> list[Image]:
    """So many seconds of film of what is done, however long it takes."""
    taken: list[tuple[float, bytes]] = []
    session = page.context.new_cdp_session(page)

    def keep(event: dict[str, Any]) -> None:
        taken.append((event["metadata"]["timestamp"], base64.b64decode(event["data"])))
        with suppress(Error):  # one that comes after the end
            session.send("Page.screencastFrameAck", {"sessionId": event["sessionId"]})

    session.on("Page.screencastFrame", keep)
    session.send("Page.startScreencast", {"format": "jpeg", "quality": 92})
    act()
    session.send("Page.stopScreencast")
    session.detach()
    told_s = np.array([at_s for at_s, _ in taken])  # a picture comes where something changes
    wanted_s = np.linspace(told_s[0], told_s[-1], round(seconds * film.RATE_HZ))
    return [_picture(taken[k][1]) for k in np.searchsorted(told_s, wanted_s, side="right") - 1]


def _picture(encoded: bytes) -> Image:
    whole = cv2.imdecode(np.frombuffer(encoded, np.uint8), cv2.IMREAD_COLOR)
    return np.ascontiguousarray(cv2.resize(whole, _SHOWN, interpolation=cv2.INTER_AREA)[:, :, ::-1])


def _play(page: Page, scene: Scene) -> None:
    _through(page, scene)
    page.get_by_role("slider").first.press("Home")
    page.wait_for_timeout(_REST_MS)


def _through(page: Page, scene: Scene) -> None:
    """Let the time run to the end."""
    page.get_by_role("button", name="Play").click()
    page.wait_for_timeout(1000 * float(scene.times_s[-1] - scene.times_s[0]) + _REST_MS)
    page.get_by_role("button", name="Pause").click()


def _drag(page: Page, scene: Scene) -> None:
    """Pick the actor ahead, and pull it to the left by its arrow."""
    camera = scene.cameras[0]
    id = _ahead(scene, camera)
    _choose(page, "Actor", re.compile(rf"^{id}:"))
    page.wait_for_timeout(_REST_MS)
    actor = scene.actor(id)
    ahead = actor.ahead(scene.up)
    assert ahead is not None
    place, left = actor.track.at(scene.times_s[:1]).positions_m[0], np.cross(scene.up, ahead)
    near, far = (_in_window(camera, place + metres * left) for metres in (1.5, 4.5))
    page.mouse.move(*near)
    page.wait_for_timeout(_REST_MS / 5)
    page.mouse.down()
    for share in np.linspace(0, 1, 24):
        page.mouse.move(*(near + share * (far - near)))
        page.wait_for_timeout(100)
    page.mouse.up()
    page.get_by_text("Changes made here: 1.").wait_for()
    page.wait_for_timeout(_REST_MS)


def _layers(page: Page) -> None:
    for layer in ("trust", "depth", "colour"):
        _choose(page, "Layer", layer)
        page.wait_for_timeout(_REST_MS)


def _path(page: Page) -> None:
    _choose(page, "Actor", "none")
    page.get_by_role("checkbox", name="Click on the road").check(force=True)
    for x, y in ((600, 680), (640, 520), (655, 450)):
        page.mouse.click(x, y)
        page.wait_for_timeout(_REST_MS)


def _along(page: Page, scene: Scene) -> None:
    _choose(page, "Camera", "path")
    _through(page, scene)


def _render(page: Page, desk: Path) -> None:
    page.get_by_role("button", name="Render video").click()
    end_s = time.monotonic() + _PATIENCE_MS / 1000
    while not list(desk.glob("*.mp4")):
        assert time.monotonic() < end_s, "the video is not rendered"
        page.wait_for_timeout(_REST_MS / 5)
    page.wait_for_timeout(_REST_MS)


def _ahead(scene: Scene, camera: Camera) -> int:
    """The actor that a view shows nearest to its middle."""
    places = [actor.track.at(scene.times_s[:1]).positions_m[0] for actor in scene.actors]
    seen = camera.project(np.stack(places))
    aside = np.where(seen[:, 2] > 0, np.abs(seen[:, 0] - camera.cx_px), np.inf)
    return scene.actors[int(np.argmin(aside))].id


def _in_window(camera: Camera, place_m: Float[np.ndarray, "3"]) -> Float[np.ndarray, "2"]:
    """Where the page shows a place: the field of view is that of the height, and its middle the window's."""
    width, height = WINDOWS[-1]
    column, row, _ = camera.project(place_m[None])[0]
    scale = height / camera.height_px
    return np.array([width / 2 + scale * (column - camera.cx_px), height / 2 + scale * (row - camera.cy_px)])


def _choose(page: Page, label: str, option: "str | re.Pattern[str]") -> None:
    page.get_by_role("combobox", name=label).click()
    page.get_by_role("option", name=option).click()
    page.wait_for_timeout(_REST_MS // 4)


def _shot(page: Page, place: Path) -> None:
    page.get_by_text("Time", exact=True).scroll_into_view_if_needed()
    with new_file(place) as partial:
        partial.write_bytes(page.screenshot(type="jpeg", quality=80))


if __name__ == "__main__":
    sys.exit(main())
