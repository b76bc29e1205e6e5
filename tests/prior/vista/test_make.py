"""From a photo to a clip."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.prior.paths import circle
from tests.prior.vista.photos import save_photo
from tests.prior.vista.tiny import FRAMES

from dreamdrive.data import write_trajectory
from dreamdrive.errors import InputError
from dreamdrive.prior import PRIORS
from dreamdrive.prior.path_to_action import waypoints
from dreamdrive.prior.vista.condition import numbers_of
from dreamdrive.scene.action import Command, Goal
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Control

BLOCK = "down_blocks.1.attentions.1"


@pytest.fixture(scope="module")
def photo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save_photo(tmp_path_factory.mktemp("photo") / "photo.png")


@pytest.fixture(scope="module")
def control(photo: Path, vista_dir: Path) -> Control:
    return Control(path=photo, weights=vista_dir, size=(64, 64), steps=1, seed=3, hfov_deg=60)


@pytest.fixture(scope="module")
def clip(control: Control) -> Clip:
    """Two rounds, every second frame, of a car told to turn left."""
    told: list[tuple[int, int]] = []
    action = Command("left")
    made = PRIORS["vista"](
        replace(control, frames=f"0:{FRAMES + 3}:2", action=action, hold_out=4),
        lambda done, total: told.append((done, total)),
    )
    assert told == [(i + 1, len(told)) for i in range(len(told))]
    return made


def test_the_clip_is_what_was_asked_for(clip: Clip) -> None:
    assert clip.source_index.tolist() == [0, 2, 4, 6, 8]
    np.testing.assert_allclose(clip.times_s, 0.2 * np.arange(5))
    assert clip.size == (64, 64)
    assert clip.held_out.tolist() == [False, False, True, False, False]
    assert clip.latents is not None
    assert clip.latents.shape == (5, 8, 8, 4)
    assert set(clip.features) == {"appearance", f"vista:{BLOCK}"}
    assert clip.features[f"vista:{BLOCK}"].shape == (5, 4, 4, 16)
    assert clip.rig[0].fx_px == pytest.approx(80 / np.tan(np.radians(30)) * 64 / 90)


def test_it_claims_no_geometry(clip: Clip) -> None:
    assert clip.known.world_from_camera is None
    assert clip.known.depth_m is None
    assert clip.requested is None
    notes = " ".join(clip.provenance["notes"])
    assert "Vista made them of photo.png in 2 rounds of 1 steps" in notes
    assert "They hold no geometry" in notes
    assert "anew in every round" in notes
    assert clip.provenance["action"] == {"kind": "command", "direction": "left"}
    assert (clip.provenance["rounds"], clip.provenance["steps"], clip.provenance["seed"]) == (2, 1, 3)


def test_seed_and_action_decide(clip: Clip, control: Control) -> None:
    def frames(**changes: object) -> np.ndarray:
        return PRIORS["vista"](replace(control, frames="0:4", **changes)).frames  # type: ignore[arg-type]

    first = frames()
    np.testing.assert_array_equal(first, frames())
    assert (frames(seed=4) != first).any()
    assert (frames(action=Command("left")) != first).any()


def test_a_path_is_told_as_its_waypoints(
    control: Control, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = circle(8.0, 0.03)
    write_trajectory(path, tmp_path / "path.json")
    told: list[object] = []
    monkeypatch.setattr(
        "dreamdrive.prior.vista.make.numbers_of", lambda action: told.append(action) or numbers_of(action)
    )
    made = PRIORS["vista"](replace(control, frames="1:4", trajectory=tmp_path / "path.json"))
    assert told == [waypoints(path)]
    assert made.requested is not None
    np.testing.assert_allclose(made.requested.world_from_camera, path.world_from_camera[:3], atol=1e-9)
    assert made.known.world_from_camera is None
    assert "A path was asked for, as four waypoints" in made.provenance["notes"][-1]


def test_svd_makes_its_frames_at_7_hz(control: Control, svd_dir: Path) -> None:
    made = PRIORS["svd"](replace(control, weights=svd_dir))
    assert len(made) == FRAMES
    assert made.times_s[1] == pytest.approx(1 / 7)
    assert set(made.features) == {"appearance", f"svd:{BLOCK}"}
    with pytest.raises(InputError, match=f"makes {FRAMES} frames and cannot go on"):
        PRIORS["svd"](replace(control, weights=svd_dir, frames=f"0:{FRAMES + 1}"))
    with pytest.raises(InputError, match="takes no action"):
        PRIORS["svd"](replace(control, weights=svd_dir, action=Command("left")))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"size": (60, 64)}, "multiples of 64"),
        ({"steps": 0}, "--steps 0: expected 1 or more"),
        ({"frames": "-3:"}, "count from the first frame"),
        ({"frames": "0:1"}, "expected two or more"),
        ({"frames": "0:999999999"}, "below 1000"),
        ({"path": None}, "needs an input, a photo"),
        ({"weights": None}, "needs --weights"),
        ({"action": Goal(2.0, 0.5)}, "between 0 and 1"),
        ({"prompt": "rain"}, "takes no prompt"),
    ],
)
def test_what_it_cannot_use_is_refused(control: Control, changes: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        PRIORS["vista"](replace(control, **changes))  # type: ignore[arg-type]


def test_too_little_memory_is_told_before_anything_is_loaded(
    control: Control, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dreamdrive.prior.vista.load.free_bytes", lambda device: 10_000_000)
    monkeypatch.setattr("dreamdrive.prior.vista.networks.Networks._load", lambda *_: pytest.fail("loaded"))
    with pytest.raises(InputError, match=r"0\.0 GB are free: no smaller size fits"):
        PRIORS["vista"](control)


def test_listing_the_priors_loads_no_network() -> None:
    code = (
        "import sys, dreamdrive.prior; print({'diffusers', 'transformers', 'accelerate'} & set(sys.modules))"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "set()"
