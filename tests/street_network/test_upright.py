"""Cameras that hang upside down or lie on their side."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch

from dreamdrive.data import read_clip
from dreamdrive.data.pictures.turned import turned_clip
from dreamdrive.errors import InputError
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Known, Recorded
from dreamdrive.street_network import load_knowledge, turns_to_upright, upright
from dreamdrive.street_network.look import Network
from dreamdrive.street_network.prediction import Prediction
from streetworld import make_street


@pytest.fixture(scope="module")
def clip() -> Clip:
    made = make_street(0, 3, size=(320, 192))
    taken = Recorded("a.mp4", is_video=True, size=(320, 192), scaled=(320, 192), offset=(0, 0))
    return Clip(
        frames=made.frames,
        times_s=made.times_s,
        camera=np.zeros(3, np.int64),
        rig=(Camera(270.0, 270.0, 150.0, 100.0, 320, 192),),
        valid=np.ones(made.frames.shape[:3], bool),
        held_out=np.zeros(3, bool),
        source_index=np.arange(3),
        recorded=taken,
        provenance={"notes": []},
    )


def test_a_camera_that_hung_upside_down_is_turned_and_an_upright_one_left_alone(clip: Clip) -> None:
    hung = turned_clip(clip)
    found = upright(hung, "street")
    assert np.array_equal(found.frames, clip.frames)
    assert (found.rig[0].cx_px, found.rig[0].cy_px) == (150, 100)
    assert any("upside down" in note for note in found.provenance["notes"])
    assert upright(clip, "street") is clip


def test_without_a_network_and_for_what_tells_how_it_hangs_nothing_is_turned(clip: Clip) -> None:
    hung = turned_clip(clip)
    for each, knowledge in (
        (hung, "none"),
        (hung, None),
        (replace(hung, recorded=None), "street"),
        (replace(hung, known=Known(generated=True)), "street"),
    ):
        assert upright(each, knowledge) is each


def test_pictures_that_lie_on_their_side_are_refused_with_the_way_to_turn_them(clip: Clip) -> None:
    frames = np.rot90(clip.frames, 3, axes=(1, 2)).copy()
    lying = replace(clip, frames=frames, valid=np.ones(frames.shape[:3], bool))
    with pytest.raises(InputError, match=r"on their side.*transpose=2"):
        upright(lying, "street")


def network(sure: Callable[[np.ndarray], np.ndarray]) -> Callable[[torch.Tensor], Prediction]:
    """Sure of the classes as far as the mean of the upper half says so, the same of all else."""

    def say(pictures: torch.Tensor) -> Prediction:
        count, _, height, width = pictures.shape
        half = height // 2, width // 2
        level = torch.from_numpy(sure(pictures[:, :, : height // 2].mean(dim=(1, 2, 3)).numpy())).float()
        classes = torch.zeros(count, 11, *half)
        classes[:, 1] = torch.log(10 * level / (1 - level))[:, None, None]
        one, quarter = torch.ones(count, *half), (height // 4, width // 4)
        camera = torch.tensor([[0.0, 0, 0, -3, -3, -3, 0]]).repeat(count, 1)
        empty = torch.full((count, 3, *quarter), -9.0), torch.zeros(count, 2, *quarter)
        return Prediction(one, one, classes, *empty, camera, torch.zeros(count, 3, *quarter))

    return say


@pytest.mark.parametrize(("bright", "turns"), [((8, 0), 2), ((7, 1), 2), ((5, 3), 0), ((0, 8), 0)])
def test_most_frames_have_to_gain(
    bright: tuple[int, int], turns: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    worse, better = bright
    frames = np.zeros((8, 64, 64, 3), np.uint8)
    frames[:worse, 32:] = 255  # brighter, and so surer, when turned
    frames[8 - better :, :32] = 255
    told = network(lambda mean: 0.3 + 0.6 * np.clip(mean, 0, 1))
    monkeypatch.setattr(sys.modules["dreamdrive.street_network.upright"], "_STREET", 0.0)
    assert turns_to_upright(frames, told) == turns
    monkeypatch.undo()
    assert turns_to_upright(frames, told) == 0  # all of this is no street


def texture() -> np.ndarray:
    coarse = np.random.default_rng(0).integers(0, 255, (27, 48, 3), np.uint8)
    return np.stack([cv2.resize(np.roll(coarse, k, 1), (480, 270)) for k in range(3)])


def noise() -> np.ndarray:
    return np.random.default_rng(1).integers(0, 255, (1, 270, 480, 3), np.uint8)


@pytest.mark.parametrize("made", [texture, noise])
def test_what_is_no_street_is_not_turned(
    monkeypatch: pytest.MonkeyPatch, made: Callable[[], np.ndarray]
) -> None:
    frames, known = made(), load_knowledge("street")
    module, told = sys.modules["dreamdrive.street_network.upright"], dict[bytes, np.ndarray]()
    sureness = module._sureness

    def once(shown: np.ndarray, network: Network) -> np.ndarray:
        """Each turn asks of the same pictures as the others."""
        key = shown.tobytes()
        if key not in told:
            told[key] = sureness(shown, network)
        return told[key]

    monkeypatch.setattr(module, "_sureness", once)
    for turn in range(4):
        assert turns_to_upright(np.rot90(frames, turn, (1, 2)).copy(), known) == 0
    assert len(told) == 4


def test_a_real_drive_turned_by_half_is_seen(data_dir: Path) -> None:
    drive = read_clip(data_dir / "clips" / "kitti_odom04_follow_van" / "frames", frames="0:45:40")
    seen = load_knowledge("street")
    assert turns_to_upright(drive.frames, seen) == 0
    assert turns_to_upright(drive.frames[:, ::-1, ::-1].copy(), seen) == 2
