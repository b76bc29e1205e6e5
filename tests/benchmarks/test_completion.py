"""States of a scene beside each other: what they add, their pictures, their figures."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import torch

from dreamdrive.build import Built
from dreamdrive.scene.geometry import Geometry
from dreamdrive.scene.scene import Scene
from dreamdrive_bench import completion
from dreamdrive_bench.oracle.views import Seen
from tests.scene.scenes import make_scene


def doubled(scene: Scene, _: Geometry) -> Scene:
    return scene.with_standing(scene.static)


@pytest.fixture
def built(monkeypatch: pytest.MonkeyPatch) -> Built:
    monkeypatch.setattr(completion, "STATES", {"bare": completion.as_fitted, "doubled": doubled})
    return cast("Built", SimpleNamespace(scene=make_scene(), geometry=None))


def test_each_state_is_made_and_shown(built: Built) -> None:
    scenes, made = completion.states_of(built)
    assert scenes["bare"] is built.scene
    assert made["bare"]["added"] == 0
    assert made["doubled"]["added"] == len(built.scene.static)
    sheet = completion.sheet_of(scenes)
    camera = built.scene.cameras[0]
    assert sheet.shape == (3 * camera.height_px, 4 * camera.width_px, 3)
    bare, twice = sheet[:, : camera.width_px], sheet[:, camera.width_px : 2 * camera.width_px]
    assert (bare != twice).any()


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
            "states": {s: {"seconds": 2.0, **dict.fromkeys(completion.VIEWS, one)} for s in completion.STATES}
        }

    told = completion.table([row(None), row(10.0), row(14.0)])
    assert told.count("12.00") == len(completion.VIEWS) * len(completion.STATES)
    assert "shift_3" in told
    assert "0.2500" in told
    assert len(completion.table([]).splitlines()) == 2
