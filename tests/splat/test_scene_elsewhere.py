"""A scene on another device is rendered there, and only its pictures come back."""

from typing import Any

import pytest
import torch

from dreamdrive.scene.scene import Scene
from dreamdrive.splat import BACKENDS, reference, render_scene
from tests.cli.test_commands import driving
from tests.fit.pretended import Elsewhere, copies_to_the_cpu, pretending, splat_there
from tests.scene.scenes import make_scene


@pytest.fixture(autouse=True)
def copies(monkeypatch: pytest.MonkeyPatch) -> list[torch.Size]:
    """Of what came back; the reference splats everywhere."""
    splat_there(monkeypatch)
    monkeypatch.setitem(BACKENDS, "native", reference.rasterize_reference)
    return copies_to_the_cpu(monkeypatch)


@pytest.fixture(params=["one camera", "moved actor"])
def scene(request: pytest.FixtureRequest) -> Scene:
    made = driving(make_scene())
    return made if request.param == "one camera" else made.moved(made.actors[0].id, 1.0, 0.5)


@pytest.mark.parametrize("part", ["all", "static", "dynamic"])
def test_views_are_the_same_with_one_copy_each(scene: Scene, copies: list[torch.Size], part: Any) -> None:
    camera, t_s = scene.cameras[1], float(scene.times_s[1])
    here = render_scene(scene, camera, t_s, part=part)
    with pretending() as device:
        there = scene.on(device)
        copies.clear()
        seen = render_scene(there, camera, t_s, part=part)
        assert copies == [(camera.height_px, camera.width_px, 6)]
    for name in ("colour", "alpha", "depth_m", "dynamic_share", "channels"):
        torch.testing.assert_close(getattr(seen, name), getattr(here, name), atol=2e-5, rtol=1e-4)
    assert seen.picture.shape == (camera.height_px, camera.width_px, 3)


def test_a_scene_elsewhere_is_a_copy(scene: Scene) -> None:
    with pretending() as device:
        there = scene.on(device)
        assert isinstance(there.static.means, Elsewhere)
        assert isinstance(there.dynamic.means, Elsewhere)
        back = there.on("cpu")
    assert not isinstance(scene.static.means, Elsewhere)
    assert torch.equal(back.static.means, scene.static.means)
