"""Pairs for the restorer, of drawn streets and of recorded drives, and what it learns from them."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import torch
from safetensors.torch import load_file

from dreamdrive.data.pictures.picture_file import write_picture
from dreamdrive.errors import InputError
from dreamdrive.restore import CHANNELS, RestorerNetwork
from dreamdrive.street_network import SHIPPED
from dreamdrive_train.pairs import PairTraining, batch_of, make_pairs, train_on_pairs
from dreamdrive_train.restorer import FIRST_SEED, RESTORER, RestorerPairs, restorer_pairs
from dreamdrive_train.restorer.pairs import drive_pairs, street_pairs
from streetworld import make_street

SMALL = RestorerPairs(each=3, frames=6, hold_out=3, sizes=((240, 144),))
TRUTH = slice(CHANNELS, CHANNELS + 3)


@pytest.mark.slow
def test_a_pair_is_a_view_from_aside_and_its_truth() -> None:
    made = list(street_pairs(np.random.default_rng(3), FIRST_SEED, SHIPPED, SMALL))
    assert 1 <= len(made) <= 3
    for planes in made:
        assert planes.shape == (CHANNELS + 4, 144, 240)
        counts = planes[-1] > 0
        off = np.abs(planes[:3].astype(int) - planes[TRUTH])[:, counts]
        assert 0.5 < off.mean() < 40
        # What surely shows the same is nearer to the truth than the frame is elsewhere.
        sure, other = counts & (planes[11] > 200), counts & (planes[11] < 50)
        off = np.abs(planes[8:11].astype(int) - planes[TRUTH]).mean(axis=0)
        assert off[sure].mean() < 0.7 * off[other].mean()


@pytest.mark.slow
def test_a_pair_of_a_drive_is_a_frame_that_no_fit_has_seen(tmp_path: Path) -> None:
    drive = make_street(5, 9, 10.0, (240, 144))
    (tmp_path / "drive").mkdir()
    for number, frame in enumerate(drive.frames):
        write_picture(tmp_path / f"drive/{number:04d}.png", frame[..., ::-1])
    options = replace(SMALL, each=4)
    made = list(drive_pairs(np.random.default_rng(0), tmp_path / "drive", 4, SHIPPED, options))
    assert len(made) == 4
    frames = {drive.frames[k].tobytes(): k for k in range(9)}
    shown = [frames[planes[TRUTH].transpose(1, 2, 0).tobytes()] for planes in made]
    assert len(set(shown)) == 4
    assert not {0, 4, 8} & set(shown)


def test_a_drive_smaller_than_what_is_cut_from_it_gives_no_pairs(tmp_path: Path) -> None:
    for number in range(3):
        write_picture(tmp_path / f"{number}.png", np.full((80, 128, 3), 80 * number, np.uint8))
    with pytest.raises(InputError, match="128x80; expected 144 pixels"):
        next(drive_pairs(np.random.default_rng(0), tmp_path, 2, SHIPPED, SMALL))


def test_a_drive_too_short_for_a_scene_gives_no_pairs(tmp_path: Path) -> None:
    for number in range(3):
        write_picture(tmp_path / f"{number}.png", np.full((144, 240, 3), 80 * number, np.uint8))
    with pytest.raises(InputError, match="has 3 frames; expected more than 4"):
        next(drive_pairs(np.random.default_rng(0), tmp_path, 4, SHIPPED, SMALL))


@pytest.mark.slow
def test_sources_are_named_and_what_cannot_be_used_gives_no_pairs(tmp_path: Path) -> None:
    (tmp_path / "none").mkdir()
    sources = restorer_pairs([tmp_path / "none"], [7], SHIPPED, SMALL)
    folder = tmp_path.name
    assert list(sources) == [f"{folder}-none-2", f"{folder}-none-4", f"{folder}-none-8", "street-7"]
    del sources["street-7"]
    assert make_pairs(sources, tmp_path / "pairs", processes=1) == []
    assert len(list((tmp_path / "pairs").glob("*.done"))) == 3


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Pairs whose view is blurred and whose first recorded frame is the truth: a few steps learn to copy."""
    folder, generator = tmp_path_factory.mktemp("shown"), np.random.default_rng(0)
    for number in range(3):
        planes = np.zeros((CHANNELS + 4, 80, 96), np.uint8)
        picture = generator.integers(0, 255, (80, 96, 3)).astype(np.uint8)
        planes[TRUTH] = planes[8:11] = picture.transpose(2, 0, 1)
        planes[:3] = cv2.blur(picture, (5, 5)).transpose(2, 0, 1)
        planes[3], planes[11], planes[-1] = 255, 255, 255
        np.save(folder / f"{number}.npy", planes)
    return sorted(folder.glob("*.npy"))


@pytest.mark.slow
def test_it_learns_to_copy_from_a_frame(shown: list[Path], tmp_path: Path) -> None:
    options = PairTraining(steps=40, batch=2, crop_px=64, warm=4, rate=2e-3, average=0.9)
    path = train_on_pairs(RESTORER, shown, tmp_path, SHIPPED, options)
    assert path is not None
    told, truth, _ = batch_of(RESTORER, shown, 10**6, PairTraining(batch=8, crop_px=64))
    network, before = RestorerNetwork(), (told[:, :3] - truth).abs().mean()
    network.load_state_dict({name: value.float() for name, value in load_file(path).items()})
    with torch.inference_mode():
        after = (network(told) - truth).abs().mean()
    assert after < 0.7 * before
    assert path.stat().st_size < 5e6
