"""The page in a browser: opened, played, clicked, dragged, saved."""

import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from dreamdrive.data import read_trajectory
from dreamdrive.edit import EDITS, Move, read_edits
from dreamdrive.scene.scene import Scene
from dreamdrive.stored import load_scene, save_scene
from tests.cli.test_commands import driving
from tests.scene.scenes import make_scene
from tests.view.chromium import browser, shoot

pytestmark = [pytest.mark.slow, pytest.mark.page]
SIZE = {"width": 1280, "height": 720}
WAIT_MS = 90_000
START = "import sys; from dreamdrive.cli.main import main; sys.argv[0] = 'dreamdrive'; main()"


@dataclass(frozen=True)
class Open:
    """A page on a scene, and the folder that it writes to."""

    page: Page
    scene: Scene
    folder: Path
    process: "subprocess.Popen[str]"
    address: str


def started(out: Path, folder: Path, *more: str) -> tuple["subprocess.Popen[str]", str]:
    """The command, and the address that it prints."""
    process = subprocess.Popen(
        [sys.executable, "-c", START, "view", str(out), "--port", "0", "-o", str(folder), *more],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    line = process.stdout.readline()
    found = re.search(r"http://\S+", line)
    assert found is not None, line + process.stdout.read()
    return process, found[0]


def ended(process: "subprocess.Popen[str]") -> tuple[int, str]:
    """How it ends after Ctrl-C, and what it said last."""
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate(timeout=30)
    return process.returncode, said


@pytest.fixture(scope="module")
def tab() -> Iterator[Callable[[], Page]]:
    with browser() as opened:
        yield lambda: opened.new_page(viewport=SIZE)  # type: ignore[arg-type]


@pytest.fixture
def opened(
    request: pytest.FixtureRequest, finished: Path, tmp_path: Path, tab: Callable[[], Page]
) -> Iterator[Open]:
    """The page of a short run; or of a small scene with an actor, where a test is marked so."""
    (tmp_path / "desk").mkdir()
    if getattr(request, "param", None) == "with an actor":
        save_scene(driving(make_scene()), tmp_path / "out" / "scene")
        finished = tmp_path / "out"
    process, address = started(finished, tmp_path / "desk")
    page = tab()
    page.goto(address)
    expect(page.get_by_role("button", name="Play")).to_be_visible(timeout=WAIT_MS)
    page.wait_for_timeout(4000)
    scene = load_scene(finished / "scene")
    yield Open(page, scene, tmp_path / "desk", process, address)
    page.close()
    code, said = ended(process)
    assert code == 130, said
    assert "Traceback" not in said
    assert "the page is closed" in said


def until(true: Callable[[], object], what: str, limit_s: float = 90) -> None:
    end = time.monotonic() + limit_s
    while not true():
        assert time.monotonic() < end, what
        time.sleep(0.2)


def test_it_plays_and_a_second_browser_has_its_own_time(opened: Open, tab: Callable[[], Page]) -> None:
    page = opened.page
    shoot(page, "open")
    first = page.screenshot()
    page.get_by_role("button", name="Play").click()
    expect(page.get_by_role("button", name="Pause")).to_be_visible(timeout=WAIT_MS)
    page.wait_for_timeout(3000)
    other = tab()
    other.goto(opened.address)
    expect(other.get_by_role("button", name="Play")).to_be_visible(timeout=WAIT_MS)
    other.close()
    expect(page.get_by_role("button", name="Pause")).to_be_visible(timeout=WAIT_MS)  # the first one plays on
    expect(page.get_by_role("combobox", name="Camera")).to_have_value("recorded")
    page.get_by_role("button", name="Pause").click()
    expect(page.get_by_role("button", name="Play")).to_be_visible(timeout=WAIT_MS)
    page.wait_for_timeout(3000)
    shoot(page, "played")
    assert page.screenshot() != first


@pytest.mark.parametrize("opened", ["with an actor"], indirect=True)
def test_an_actor_is_picked_moved_and_saved(opened: Open) -> None:
    page, actor = opened.page, opened.scene.actors[0]
    page.get_by_role("combobox", name="Actor").click()
    page.get_by_role("option", name=re.compile(rf"^{actor.id}:")).click()
    expect(page.get_by_text("Drag it by its arrows")).to_be_visible(timeout=WAIT_MS)
    page.get_by_role("button", name="Turn", exact=True).click()
    expect(page.get_by_text("Changes made here: 1.")).to_be_visible(timeout=WAIT_MS)
    shoot(page, "turned")
    page.get_by_role("button", name="Save as").click()
    until((opened.folder / "out-edited" / EDITS).is_file, "it is saved")
    edits = read_edits(opened.folder / "out-edited" / EDITS).edits
    assert len(edits) == 1
    assert not isinstance(edits[0], Move)
    page.get_by_role("button", name="Save as").click()  # it is there now, and asked for
    expect(page.get_by_role("button", name="Keep it")).to_be_visible(timeout=WAIT_MS)
    page.get_by_role("button", name="Keep it").click()
    page.get_by_role("button", name="Undo").click()
    expect(page.get_by_text("Click a box or a track in the picture.")).to_have_count(0)


def test_a_path_is_drawn_saved_and_rendered(opened: Open) -> None:
    page = opened.page
    page.get_by_text("Click on the road").scroll_into_view_if_needed()
    page.get_by_role("checkbox", name="Click on the road").check(force=True)
    page.wait_for_timeout(1000)
    for x, y in ((470, 640), (520, 480), (540, 430)):
        page.mouse.click(x, y)
        page.wait_for_timeout(1500)
    expect(page.get_by_text(re.compile(r"3 points, [\d.]+ m"))).to_be_visible(timeout=WAIT_MS)
    shoot(page, "path")
    page.get_by_role("combobox", name="Camera").click()
    page.get_by_role("option", name="path").click()
    page.wait_for_timeout(1000)
    page.get_by_role("button", name="Save path").click()
    until((opened.folder / "out-path.json").is_file, "the path is saved")
    drive = read_trajectory(opened.folder / "out-path.json")
    assert drive.length_m > 2
    page.get_by_role("button", name="Render video").click()
    until((opened.folder / "out-path.mp4").is_file, "the video is rendered")


def test_a_run_at_work_becomes_the_scene(finished: Path, tmp_path: Path, tab: Callable[[], Page]) -> None:
    out = tmp_path / "run"
    (out / "stages").mkdir(parents=True)
    process, address = started(out, tmp_path, "--during")
    page = tab()
    page.goto(address)
    expect(page.get_by_text("A scene is being made")).to_be_visible(timeout=WAIT_MS)
    for name in ("prior", "look", "geometry", "initialise"):
        shutil.copytree(finished / "stages" / name, out / "stages" / name)
    shutil.copy(finished / "stages" / "first.png", out / "stages")
    expect(page.get_by_text("static is at work")).to_be_visible(timeout=WAIT_MS)
    shoot(page, "during")
    shutil.copytree(finished / "stages" / "static", out / "stages" / "static")
    expect(page.get_by_text("Nothing in this scene moves on a track")).to_be_visible(timeout=WAIT_MS)
    expect(page.get_by_role("button", name="Play")).to_be_visible(timeout=WAIT_MS)
    shutil.copytree(finished / "scene", out / "scene")
    shutil.copy(finished / "report.json", out)
    page.wait_for_timeout(5000)
    expect(page.get_by_role("button", name="Play")).to_be_visible(timeout=WAIT_MS)
    page.close()
    assert ended(process)[0] == 130
