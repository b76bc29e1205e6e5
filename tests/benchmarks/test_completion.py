"""States of a scene beside each other: what they add, their pictures, their figures."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import torch

from dreamdrive.build import Built
from dreamdrive.restore import RestorerNetwork
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive.splat import SceneView, render_scene
from dreamdrive_bench import completion
from dreamdrive_bench.oracle.views import Seen
from tests.scene.scenes import make_scene


def doubled(scene: Scene, *_: object) -> Scene:
    return scene.with_standing(scene.static)


def darkened(built: Built, scene: Scene, network: RestorerNetwork) -> SimpleNamespace:
    def view(camera: Camera, t_s: float) -> SceneView:
        seen = render_scene(scene, camera, t_s)
        return replace(seen, colour=0.5 * seen.colour)

    return SimpleNamespace(view=view)


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> Built:
    monkeypatch.setattr(completion, "completed", doubled)
    monkeypatch.setattr(completion, "restorer_of", darkened)
    return cast("Built", SimpleNamespace(scene=make_scene(), geometry=None))


def test_each_state_is_made_and_shown(built: Built) -> None:
    states, made = completion.states_of(built, RestorerNetwork((8, 8)))
    assert states["bare"].scene is states["restored"].scene is built.scene
    assert [made[name]["added"] for name in states] == [0, len(built.scene.static)] * 2
    sheet = completion.sheet_of(states)
    width, height = built.scene.cameras[0].width_px, built.scene.cameras[0].height_px
    assert sheet.shape == (6 * height, 4 * width, 3)
    bare, twice, restored, _ = (sheet[:, k * width : (k + 1) * width] for k in range(4))
    assert (bare != twice).any()
    assert (bare != restored).any()


def test_a_drive_is_judged_where_its_frames_count(built: Built) -> None:
    scene = built.scene
    states, _ = completion.states_of(built, RestorerNetwork((8, 8)))
    pictures = [
        render_scene(scene, scene.cameras[k], float(scene.times_s[k])).picture
        for k in range(len(scene.cameras))
    ]
    frames, fixed = np.stack(pictures), np.zeros((1, *pictures[0].shape[:2]), np.uint8)
    frames[:, :4] = 255 - frames[:, :4]  # of the own car
    fixed[:, :4] = 1
    count = len(frames)
    clip = SimpleNamespace(
        frames=frames,
        times_s=scene.times_s,
        camera=np.zeros(count, int),
        valid=np.ones(frames.shape[:3], bool),
        held_out=np.arange(count) == 1,
    )
    judged = [
        completion.withheld(
            states[name], cast("Clip", clip), cast("Geometry", SimpleNamespace(fixed_regions=fixed))
        )
        for name in ("bare", "restored")
    ]
    assert judged[0] == pytest.approx(100)
    assert judged[1] is not None
    assert judged[1] < 40


def test_figures_are_of_their_pixels() -> None:
    true = np.full((3, 4, 6, 3), 100, np.uint8)
    shown = true[[0, 2]].copy()
    shown[:, :, :3] += 51  # a fifth of white, in the left half
    left = np.zeros(true.shape[:3], bool)
    left[:, :, :3] = True
    groups = {"all": np.ones_like(left), "standing": ~left, "moving": np.zeros_like(left), "unseen": left}
    truth = Seen(true, groups, true, np.ones(3, bool))

    def distance(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
        return (a - b).abs().mean(dim=(1, 2, 3))

    shown[:, :, 3:] += 1
    found = completion.figures(shown, truth, np.array([0, 2]), distance)
    assert found["moving"] is None
    assert found["unseen"] == pytest.approx(-20 * np.log10(0.2), abs=1e-3)
    assert found["standing"] == pytest.approx(-20 * np.log10(1 / 255), abs=1e-3)
    assert found["stlpips"] == pytest.approx(26 / 127.5, abs=1e-4)


def test_the_table_has_means_of_what_is_there() -> None:
    def row(db: float | None) -> dict[str, Any]:
        one = {**dict.fromkeys(completion.GROUPS, 20.0), "moving": db, "stlpips": 0.25}
        return {
            "states": {
                s: {"seconds": 2.0, "frame_s": 0.5, **dict.fromkeys(completion.VIEWS, one)}
                for s in completion.STATES
            }
        }

    told = completion.table([row(None), row(10.0), row(14.0)])
    assert told.count("12.00") == len(completion.VIEWS) * len(completion.STATES)
    assert "shift_3" in told
    assert "0.2500" in told
    assert len(completion.table([]).splitlines()) == 2
