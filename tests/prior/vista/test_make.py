"""From a photo to a clip."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor

from dreamdrive.data import write_trajectory
from dreamdrive.errors import InputError
from dreamdrive.prior import PRIORS
from dreamdrive.prior.path import path_of, waypoints_by_round
from dreamdrive.prior.vista.condition import numbers_of
from dreamdrive.prior.vista.engine import Engine, RoundConditions
from dreamdrive.prior.vista.memory import Job
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Command, Control, Goal, Steering, Waypoints
from tests.prior.paths import circle
from tests.prior.vista.photos import save_photo
from tests.prior.vista.tiny import FRAMES

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


@pytest.mark.slow
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
    assert told == waypoints_by_round(path, np.zeros(1), 0.0)
    assert made.requested is not None
    np.testing.assert_allclose(made.requested.world_from_camera, path.world_from_camera[:3], atol=1e-9)
    assert made.known.world_from_camera is None
    assert "A path was asked for, as four waypoints" in made.provenance["notes"][-1]


@pytest.mark.parametrize(
    "action", [Waypoints((0, 0, -0.5, -1), (4, 8, 12, 16)), Steering((8.0,) * 4, (0, 0, 0.1, 0.1))]
)
def test_an_action_that_says_a_path_asks_for_it_in_every_round(
    control: Control, action: Waypoints | Steering
) -> None:
    made = PRIORS["vista"](replace(control, frames=f"1:{FRAMES + 3}", action=action))
    assert made.requested is not None
    one = path_of(action, np.arange(FRAMES) / 10).world_from_camera
    poses = np.concatenate([one[1:4], one[3] @ one[1:]])
    np.testing.assert_allclose(made.requested.world_from_camera, np.linalg.inv(one[1]) @ poses, atol=1e-9)
    assert made.known.world_from_camera is None
    assumed = "steering ratio of 16.6 is assumed" in " ".join(made.provenance["notes"])
    assert assumed == isinstance(action, Steering)


def test_features_are_looked_at_as_the_frames_were_made(
    control: Control, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Conditional predictions: action, first frame's latent and fixed frames of both rounds, and again."""
    predictions: list[tuple[Tensor, Tensor, list[float]]] = []
    predict = Engine.predict

    def watched(
        engine: Engine, seen: RoundConditions, x: Tensor, time: float, mask: Tensor, given: float = 1.0
    ):
        if given:
            assert seen.action is not None
            predictions.append((seen.action, seen.latent, mask.tolist()))
        return predict(engine, seen, x, time, mask, given)

    monkeypatch.setattr(Engine, "predict", watched)
    write_trajectory(circle(8.0, 0.03), tmp_path / "path.json")
    PRIORS["vista"](replace(control, frames=f"0:{FRAMES + 3}", trajectory=tmp_path / "path.json"))
    assert len(predictions) == 4
    for sampled, again in zip(predictions[:2], predictions[2:], strict=True):
        assert torch.equal(sampled[0], again[0])
        torch.testing.assert_close(sampled[1], again[1])
        assert sampled[2] == again[2]
    assert [sum(fixed) for _, _, fixed in predictions] == [1, 3, 1, 3]


def test_svd_makes_its_frames_at_7_hz(control: Control, svd_dir: Path) -> None:
    made = PRIORS["svd"](replace(control, weights=svd_dir))
    assert len(made) == FRAMES
    assert made.times_s[1] == pytest.approx(1 / 7)
    assert set(made.features) == {"appearance", f"svd:{BLOCK}"}
    with pytest.raises(InputError, match=f"makes {FRAMES} frames and cannot go on"):
        PRIORS["svd"](replace(control, weights=svd_dir, frames=f"0:{FRAMES + 1}"))
    with pytest.raises(InputError, match="takes no --action"):
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
        ({"action": Goal(2.0, 0.5)}, "outside its range: column is 2; expected 0 to 1"),
        ({"action": Waypoints((900.0,) * 4, (1.0,) * 4)}, "outside its range: right_m is 900"),
        ({"prompt": "rain"}, "takes no --prompt"),
    ],
)
def test_what_it_cannot_use_is_refused(control: Control, changes: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        PRIORS["vista"](replace(control, **changes))  # type: ignore[arg-type]


def test_too_little_memory_is_told_before_anything_is_loaded(
    control: Control, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dreamdrive.prior.vista.engine.free_bytes", lambda *device: 10_000_000)
    monkeypatch.setattr(Engine, "_load", lambda *_: pytest.fail("loaded"))
    with pytest.raises(InputError, match=r"0\.0 GB are free: no smaller size fits"):
        PRIORS["vista"](control)


@pytest.mark.parametrize(("frames", "made"), [("0:4", 6), ("0:7", 9), ("900:", 906), ("3:20:4", 21)])
def test_memory_is_planned_for_all_frames_that_are_made(
    control: Control, monkeypatch: pytest.MonkeyPatch, frames: str, made: int
) -> None:
    def stop(engine: Engine, job: Job) -> None:
        raise InputError(f"{job.frames} of {job.per_round}")

    monkeypatch.setattr(Engine, "check_fit", stop)
    with pytest.raises(InputError, match=f"^{made} of {FRAMES}$"):
        PRIORS["vista"](replace(control, frames=frames))


@pytest.mark.parametrize("where", ["predict", "decode"])
def test_numbers_that_are_not_finite_are_refused(
    control: Control, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    right = getattr(Engine, where)
    monkeypatch.setattr(Engine, where, lambda *given: right(*given) * torch.nan)
    with pytest.raises(InputError, match=r"gave (latents|frames) that hold NaN.*; its weights are damaged"):
        PRIORS["vista"](control)


def test_a_gpu_that_is_too_small_is_a_message(control: Control, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*given: object) -> None:
        raise torch.OutOfMemoryError("CUDA out of memory. Tried to allocate 2 GiB")

    monkeypatch.setattr(Engine, "decode", full)
    with pytest.raises(InputError, match=r"memory does not suffice .*smaller --size, such as 128x64"):
        PRIORS["vista"](replace(control, size=(192, 64)))
