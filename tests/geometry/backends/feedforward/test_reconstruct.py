"""From a clip to a geometry in metres."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.geometry import BACKENDS, GeometryOptions, reconstruct
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.street.truth import DriveTruth
from tests.geometry.backends.feedforward.fakes import Truth


@pytest.mark.parametrize("kind", ["mapanything"])
def test_a_metric_network_keeps_its_metre(kind: str, clip: Clip, drive: DriveTruth, weights: Path) -> None:
    found = reconstruct(clip, GeometryOptions(method=kind, weights=weights, camera_height_m=3.0))
    assert found.scale.source == "the metric network MapAnything"
    assert found.scale.spread == 0.15
    assert found.cameras[-1].world_from_camera == pytest.approx(drive.cameras[-1].world_from_camera, abs=1e-3)
    assert found.details["chunk_scales"] == [1.0]


@pytest.mark.parametrize("kind", ["da3"])
def test_another_gets_it_from_the_road(kind: str, clip: Clip, drive: DriveTruth, weights: Path) -> None:
    found = reconstruct(clip, GeometryOptions(method=kind, weights=weights, camera_height_m=1.5))
    truth = drive.trajectory.world_from_camera[-1, :3, 3]
    error = found.cameras[-1].world_from_camera[:3, 3] - truth
    assert np.linalg.norm(error) < 0.05 * np.linalg.norm(truth)
    assert "ground plane" in found.scale.source
    assert not found.depth_m[clip.held_out].any()


@pytest.mark.parametrize("kind", ["mapanything"])
def test_numbers_that_are_no_cameras_are_refused(
    kind: str, clip: Clip, weights: Path, truth: Truth, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = truth.of
    for name, value, message in (("poses", torch.nan, "not finite"), ("intrinsics", 0.0, "not positive")):

        def wrong(*args: object, name: str = name, value: float = value, **more: object) -> object:
            seen = right(*args, **more)  # type: ignore[arg-type]
            setattr(seen, name, torch.full_like(getattr(seen, name), value))
            return seen

        monkeypatch.setattr(truth, "of", wrong)
        with pytest.raises(InputError, match=message):
            BACKENDS[kind].reconstruct.measure(clip, clip.valid, weights)  # type: ignore[attr-defined]


@pytest.mark.parametrize("kind", ["pi3", "pi3x"])
def test_known_poses_that_stand_still_give_no_unit(kind: str, clip: Clip, weights: Path) -> None:
    still = replace(clip, known=Known(np.tile(np.eye(4), (len(clip), 1, 1))))
    way = BACKENDS["pi3"].reconstruct
    if kind == "pi3x":
        assert way.measure(still, clip.valid, weights).others == {  # type: ignore[attr-defined]
            "the network Pi3X, metric approximately": 1.0
        }
        return
    with pytest.raises(InputError, match="the given poses stand still, but the clip does not"):
        way.measure(still, clip.valid, weights)  # type: ignore[attr-defined]
