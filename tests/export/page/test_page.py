from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.export import EXPORTS, export, function
from dreamdrive.export.moving import at_moments
from dreamdrive.export.page.page import scene_to_page
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import render_scene
from dreamdrive.stored import load_scene
from tests.scene.scenes import make_baseline, make_scene, per_frame_scene

if TYPE_CHECKING:
    from playwright.sync_api import Page

_SMALL = 60


def _psnr(a: np.ndarray, b: np.ndarray) -> float:
    """Of two pictures in bytes, both shrunk to 60 columns."""
    small = [
        cv2.resize(each.astype(float), (_SMALL, round(_SMALL * a.shape[0] / a.shape[1])), interpolation=3)
        for each in (a, b)
    ]
    return float(-10 * np.log10(np.mean((small[0] - small[1]) ** 2) / 255**2 + 1e-10))


def _drawn(page: "Page", camera: Camera, t_s: float) -> tuple[np.ndarray, np.ndarray]:
    """What the page draws of a pinhole at a pose: RGB in bytes and coverage."""
    names = ("fx_px", "fy_px", "cx_px", "cy_px", "width_px", "height_px")
    asked = {
        "time_s": t_s,
        "world_from_camera": camera.world_from_camera.ravel().tolist(),
        "camera": {name: getattr(camera, name) for name in names},
    }
    got = page.evaluate("asked => dreamdrive.draw(asked)", asked)
    shape = got["height"], got["width"]
    return np.array(got["rgb"], np.uint8).reshape(*shape, 3), np.array(got["alpha"]).reshape(shape)


@pytest.mark.page
@pytest.mark.slow
def test_a_browser_draws_what_the_program_draws(finished: Path, tmp_path: Path) -> None:
    from tests.export.page.browser import opened

    scene = load_scene(finished / "scene")
    export(scene, "html", tmp_path / "a.html")
    camera = scene.cameras[0]
    times_s = np.linspace(scene.times_s[0], scene.times_s[-1], 3)
    with opened(tmp_path / "a.html", "t=0&plain", (camera.width_px, camera.height_px)) as page:
        for t_s in times_s.tolist():
            here = camera.at(scene.trajectory.at(np.array([t_s]))[0])
            for view in (here, here.moved(right_m=1.0)):
                seen = render_scene(scene, view, t_s)
                picture, alpha = _drawn(page, view, t_s)
                assert _psnr(picture, seen.picture) > 40
                assert ((alpha > 0.5) == (seen.alpha.numpy() > 0.5)).mean() > 0.99


@pytest.mark.page
@pytest.mark.slow
def test_the_address_says_when_and_from_where(finished: Path, tmp_path: Path) -> None:
    from tests.export.page.browser import opened

    scene = load_scene(finished / "scene")
    export(scene, "html", tmp_path / "a.html")
    t_s = float(scene.times_s[2])
    view = scene.cameras[2].moved(right_m=1.0)
    with opened(tmp_path / "a.html", f"t={t_s}&right=1&plain", (view.width_px, view.height_px)) as page:
        page.wait_for_function("document.getElementById('clock').textContent")
        shot = np.array(cv2.imdecode(np.frombuffer(page.screenshot(), np.uint8), cv2.IMREAD_COLOR))[..., ::-1]
        assert _psnr(shot, render_scene(scene, view, t_s).picture) > 40
        assert page.text_content("#clock") == f"{t_s:.2f} s"


@pytest.mark.page
@pytest.mark.slow
def test_people_play_and_fly(tmp_path: Path) -> None:
    from tests.export.page.browser import opened

    scene = make_scene()
    export(scene, "html", tmp_path / "a.html")
    with opened(tmp_path / "a.html", f"t={scene.times_s[0]}", (320, 240)) as page:
        assert page.inner_text("#play") == "Play"
        page.keyboard.press("Space")
        page.wait_for_function("Number(document.getElementById('time').value) > 0")
        assert page.inner_text("#play") == "Pause"
        assert page.is_disabled("#drive")
        page.keyboard.down("w")
        page.wait_for_function("!document.getElementById('drive').disabled")
        page.keyboard.up("w")
        page.click("#drive")
        page.wait_for_function("document.getElementById('drive').disabled")
        page.mouse.move(100, 100)
        page.mouse.down()
        page.mouse.move(160, 110)
        page.mouse.up()
        page.wait_for_function("!document.getElementById('drive').disabled")


@pytest.mark.page
@pytest.mark.slow
@pytest.mark.parametrize("motion", ["vibration", "per frame", "degree 3"])
def test_every_motion_is_drawn(motion: str, tmp_path: Path) -> None:
    from tests.export.page.browser import opened

    scene = _in_view(
        {"vibration": lambda: make_baseline("vibration"), "per frame": per_frame_scene}.get(
            motion, _of_degree_3
        )()
    )
    export(scene, "html", tmp_path / "a.html")
    with opened(tmp_path / "a.html", "t=0&plain", (64, 48)) as page:
        for t_s in scene.times_s.tolist():
            seen = render_scene(scene, scene.cameras[0], t_s)
            picture, alpha = _drawn(page, scene.cameras[0], t_s)
            assert _psnr(picture, seen.picture) > 35
            assert np.abs(alpha - seen.alpha.numpy()).max() < 0.05
            assert (alpha > 0.1).any()


def _in_view(scene: Scene) -> Scene:
    """The scene from 6 m behind it, where all of it is in the picture."""
    pose = np.eye(4)
    pose[2, 3] = -6
    return replace(scene, cameras=tuple(camera.at(pose) for camera in scene.cameras))


def _of_degree_3() -> Scene:
    scene = make_scene()
    generator = torch.Generator().manual_seed(1)

    def coloured(gaussians: Gaussians) -> Gaussians:
        return replace(gaussians, sh=0.4 * torch.randn(len(gaussians), 16, 3, generator=generator))

    return replace(scene, static=coloured(scene.static), dynamic=coloured(scene.dynamic))


@pytest.mark.parametrize("make", [make_scene, per_frame_scene, lambda: make_baseline("vibration")])
def test_at_its_moments_all_is_in_place(make: Callable[[], Scene]) -> None:
    scene = make()
    for moment, t_s in enumerate(scene.times_s.tolist()):
        still = scene.static_at(t_s), scene.dynamic_at(t_s)
        for got, all_of_it, there in zip(
            at_moments(scene, scene.times_s), (scene.static, scene.dynamic), still, strict=True
        ):
            late = (t_s - got.lives_s[:, 0]) / np.where(got.lives_s[:, 1] > 0, got.lives_s[:, 1], np.inf)
            opacities = got.opacities * np.exp(-0.5 * late**2)
            alive = all_of_it.alive_at(t_s).numpy() if there is still[1] else np.arange(len(all_of_it))
            row = got.offsets + np.clip(moment, got.first, got.last) - got.first
            assert np.allclose(got.means[row][alive], there.means, atol=1e-5)
            assert np.allclose(got.log_scales[row][alive], there.log_scales, atol=1e-5)
            assert np.allclose(opacities[alive], torch.sigmoid(there.logit_opacities), atol=1e-5)


def test_what_cannot_be_written_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.html"):
        scene_to_page(make_scene(), tmp_path / "a.txt")
    with pytest.raises(InputError, match="later than the one before"):
        scene_to_page(make_scene(), tmp_path / "a.html", times_s=[1.0, 1.0])
    assert list(tmp_path.iterdir()) == []


def test_a_name_cannot_leave_its_text(tmp_path: Path) -> None:
    scene = make_scene()
    named = replace(scene, provenance=replace(scene.provenance, input="</script><b>@PAGE@"))
    scene_to_page(named, tmp_path / "a.html")
    assert "</script><b>" not in (tmp_path / "a.html").read_text("utf-8")


def test_moments_can_be_chosen_and_what_is_lost_is_said(tmp_path: Path) -> None:
    scene = make_scene()
    scene_to_page(scene, tmp_path / "a.html", times_s=[0.4])
    assert '"moments_s": [0.0]' in (tmp_path / "a.html").read_text("utf-8")
    chosen = EXPORTS.choose("html")
    assert chosen.left_out is not None
    assert "motion is straight" in function(chosen.left_out)(scene, tmp_path / "a.html")
