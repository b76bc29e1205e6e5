"""The finished view: sky behind, exposure on top, parts apart."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.exposure import Exposure
from dreamdrive.scene.gaussians import SH_C0, Gaussians
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.sky import Sky
from dreamdrive.splat.scene_view import render_scene

CAMERA = Camera(60.0, 60.0, 32.0, 24.0, 64, 48)


def ball(x: float, z: float, colour: tuple[float, float, float], **more: torch.Tensor) -> Gaussians:
    """One nearly opaque ball of 0.5 m."""
    return Gaussians(
        means=torch.tensor([[x, 0.0, z]]),
        quaternions=torch.tensor([[1.0, 0, 0, 0]]),
        log_scales=torch.full((1, 3), np.log(0.5)),
        logit_opacities=torch.tensor([6.0]),
        sh=((torch.tensor(colour) - 0.5) / SH_C0)[None, None],
        source_frame=torch.zeros(1, dtype=torch.int64),
        **more,
    )


def scene(**changes: object) -> Scene:
    """Red static ball on the left, green dynamic ball on the right, blue sky."""
    plain = Scene(
        static=ball(-1.5, 6.0, (1, 0, 0)),
        dynamic=ball(1.5, 6.0, (0, 1, 0)),
        deformation=None,
        actors=(),
        sky=Sky(torch.tensor([0, 0, 1.0]).expand(2, 4, 3).contiguous(), (-1.0, 1.0), (-1.0, 1.0)),
        exposure=None,
        cameras=(CAMERA,),
        times_s=np.array([0.0]),
        held_out=np.array([False]),
    )
    return replace(plain, **changes)


def test_sky_fills_what_gaussians_leave() -> None:
    view = render_scene(scene(), CAMERA, 0.0)
    torch.testing.assert_close(view.colour[2, 32], torch.tensor([0.0, 0, 1]), atol=0.01, rtol=0)
    torch.testing.assert_close(view.colour[24, 17], torch.tensor([1.0, 0, 0]), atol=0.03, rtol=0)
    torch.testing.assert_close(view.colour[24, 47], torch.tensor([0.0, 1, 0]), atol=0.03, rtol=0)


def test_dynamic_share_marks_the_dynamic_ball() -> None:
    view = render_scene(scene(), CAMERA, 0.0)
    assert view.dynamic[24, 47]
    assert not view.dynamic[24, 17]
    assert not view.dynamic[2, 32]
    assert (view.dynamic_share <= view.alpha + 1e-5).all()


def test_depth_is_in_metres_along_z() -> None:
    view = render_scene(scene(), CAMERA, 0.0)
    assert view.depth_m[24, 17].item() == pytest.approx(6.0, abs=0.01)
    assert view.depth_m[0, 32].item() == 0
    assert view.seen_depth_m[24, 17] == pytest.approx(6.0, abs=0.01)
    faint = ((view.alpha > 0) & (view.alpha < 0.5)).numpy()
    assert faint.any()
    assert (view.seen_depth_m[faint] == 0).all()


def test_a_picture_is_the_nearest_bytes() -> None:
    view = render_scene(scene(), CAMERA, 0.0)
    assert view.picture.dtype == np.uint8
    assert np.abs(view.picture / 255 - view.colour.numpy()).max() <= 0.5 / 255 + 1e-6


@pytest.mark.parametrize(("part", "left", "right"), [("static", True, False), ("dynamic", False, True)])
def test_parts_alone(part: str, left: bool, right: bool) -> None:
    view = render_scene(scene(), CAMERA, 0.0, part=part)
    assert (view.alpha[24, 17] > 0.9) == left
    assert (view.alpha[24, 47] > 0.9) == right
    assert (view.colour[2, 32, 2] > 0.9) == (part == "static")


def test_exposure_comes_last_and_colours_stay_in_range() -> None:
    brighter = Exposure(1.5 * torch.eye(3, 4)[None], np.array([0.0]))
    darker = Exposure(0.5 * torch.eye(3, 4)[None], np.array([0.0]))
    plain = render_scene(scene(), CAMERA, 0.0).colour
    dark = render_scene(scene(exposure=darker), CAMERA, 0.0).colour
    torch.testing.assert_close(dark, 0.5 * plain)
    assert torch.equal(render_scene(scene(exposure=darker), CAMERA, 0.0, exposure=False).colour, plain)
    assert render_scene(scene(exposure=brighter), CAMERA, 0.0).colour.max() <= 1


def test_life_spans_fade_with_time() -> None:
    brief = ball(1.5, 6.0, (0, 1, 0), lifespan=torch.tensor([[1.0, 0.2]]), actor=torch.tensor([-1]))
    at_peak, later = (render_scene(scene(dynamic=brief), CAMERA, t).alpha[24, 47] for t in (1.0, 3.0))
    assert at_peak > 0.9
    assert later < 0.01


def test_further_channels_are_composited() -> None:
    view = render_scene(scene(), CAMERA, 0.0, channels=torch.tensor([[2.0, 0.0], [0.0, 3.0]]))
    assert view.channels.shape == (48, 64, 2)
    assert view.channels[24, 17, 0].item() == pytest.approx(2, rel=0.02)
    assert view.channels[24, 47, 1].item() == pytest.approx(3, rel=0.02)


def test_a_scene_without_dynamic_things_or_sky() -> None:
    empty = scene().dynamic.select(torch.tensor([False]))
    view = render_scene(scene(dynamic=empty, sky=None), CAMERA, 0.0)
    assert not view.dynamic.any()
    assert view.colour[2, 32].max() == 0
    assert render_scene(scene(dynamic=empty), CAMERA, 0.0, part="dynamic").alpha.max() == 0


def test_the_black_behind_what_moves_is_not_exposed() -> None:
    """An exposure that brightens everything by 0.2 brightens the ball and leaves the black."""
    brighter = Exposure(torch.cat([torch.eye(3), torch.full((3, 1), 0.2)], dim=1)[None], np.array([0.0]))
    view = render_scene(scene(exposure=brighter), CAMERA, 0.0, part="dynamic")
    assert view.colour[view.alpha == 0].abs().max() == 0
    torch.testing.assert_close(view.colour[24, 47], torch.tensor([0.2, 1, 0.2]), atol=0.03, rtol=0)
