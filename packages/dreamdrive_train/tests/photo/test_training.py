"""The network of the prior ``photo`` and its training."""

from pathlib import Path

import cv2
import numpy as np
import pytest
import torch
from safetensors.torch import load_file

from dreamdrive.errors import InputError
from dreamdrive.prior.photo import layers_of
from dreamdrive.prior.photo.fill import inpainted
from dreamdrive.prior.photo.network import CHANNELS, Before, PhotoNetwork, load_photo_network, mended, told
from dreamdrive.prior.photo.sight import sight_of
from dreamdrive.street_network import SHIPPED
from dreamdrive_train.pairs import PairTraining, batch_of, make_pairs, train_on_pairs
from dreamdrive_train.photo import PHOTO, PairOptions, photo_pairs
from dreamdrive_train.photo.pairs import FIRST_SEED, street_pairs
from streetworld import make_street
from tests.prior.photo.streets import GROUND, street

SMALL = (240, 136)
PLANES = CHANNELS + 4


@pytest.fixture(scope="module")
def pairs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("pictures")
    frame = make_street(5, 1, 10.0, SMALL).frames[0]
    cv2.imwrite(str(folder / "street.png"), frame[..., ::-1])
    options = PairOptions(each=2, size=SMALL)
    sources = photo_pairs([folder / "street.png"], [], SHIPPED, options)
    return make_pairs(sources, folder / "pairs", processes=1)


def test_an_untrained_network_changes_nothing() -> None:
    photo = street()
    sight = sight_of(layers_of(photo), photo.camera, GROUND)
    picture, features = mended(PhotoNetwork(), sight, photo.camera, None)
    np.testing.assert_array_equal(picture, inpainted(sight.rgb, sight.holes))
    assert features.shape[:2] == (27, 48)


def test_the_network_that_ships_answers_as_it_did_when_it_was_trained() -> None:
    photo = street()
    pose = np.eye(4)
    pose[0, 3] = 1.5
    here = photo.camera.at(pose)
    sight = sight_of(layers_of(photo), here, GROUND)
    picture, features = mended(load_photo_network(), sight, here, Before(photo.rgb, photo.camera))
    made_up = (sight.made_up > 0.5) | sight.holes
    np.testing.assert_allclose(picture[made_up].mean(0), [95.2, 77.6, 74.4], atol=0.6)
    np.testing.assert_allclose(picture[made_up].std(0), [27.6, 12.2, 21.5], atol=0.6)
    np.testing.assert_allclose((features.mean(), features.std()), (-0.0034, 0.1234), atol=0.001)
    assert features.shape == (27, 48, 40)
    known = ~made_up & (sight.made_up < 0.01)
    np.testing.assert_array_equal(picture[known], sight.rgb[known])


def test_the_frame_before_is_carried_along_the_surface() -> None:
    photo = street()
    layers = layers_of(photo)
    there = photo.camera.at(np.eye(4))
    pose = np.eye(4)
    pose[2, 3] = 2.0
    here = photo.camera.at(pose)
    sight = sight_of(layers, here, GROUND)
    planes = told(sight, here, Before(photo.rgb, there))
    assert planes.shape == (CHANNELS, *photo.depth_m.shape)
    known = planes[10] > 0
    assert known.mean() > 0.4
    off = np.abs(planes[7:10] - sight.rgb.transpose(2, 0, 1) / 255).mean(0)[known]
    assert np.median(off) < 0.02


def test_a_pair_is_the_picture_and_what_a_drive_makes_of_it(pairs: list[Path]) -> None:
    assert len(pairs) == 2
    planes = np.load(pairs[0], allow_pickle=False)
    assert planes.shape == (PLANES, 136, 240)
    off = np.abs(planes[:3].astype(int) - planes[CHANNELS : CHANNELS + 3])[:, planes[-1] > 0]
    assert 0.5 < off.mean() < 25


def test_a_pair_of_a_drawn_street_knows_what_is_behind_things() -> None:
    made = list(street_pairs(np.random.default_rng(0), FIRST_SEED, PairOptions(each=2, size=SMALL)))
    assert [planes.shape for planes in made] == [(PLANES, 136, 240)] * 2
    for planes in made:
        off = np.abs(planes[:3].astype(int) - planes[CHANNELS : CHANNELS + 3])[:, planes[-1] > 0]
        assert 0.5 < off.mean() < 40
        assert (planes[4] > 128).mean() > 0.003


@pytest.fixture(scope="module")
def dim(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Pairs whose view is the picture, darker: a few steps learn it."""
    folder, generator = tmp_path_factory.mktemp("dim"), np.random.default_rng(0)
    for number in range(3):
        planes = np.zeros((PLANES, 80, 96), np.uint8)
        picture = cv2.resize(generator.integers(60, 255, (5, 6, 3)).astype(np.uint8), (96, 80))
        planes[CHANNELS : CHANNELS + 3] = picture.transpose(2, 0, 1)
        planes[:3] = planes[CHANNELS : CHANNELS + 3] - 50
        planes[3], planes[-1] = 255, 255
        np.save(folder / f"{number}.npy", planes)
    return sorted(folder.glob("*.npy"))


def off(network: PhotoNetwork, pairs: list[Path]) -> float:
    """Mean error on squares that the training has not drawn."""
    seen, truth, counts = batch_of(PHOTO, pairs, 10**6, PairTraining(batch=8, crop_px=64))
    with torch.inference_mode():
        return float((counts * (network(seen)[0] - truth).abs()).mean())


@pytest.mark.slow
def test_the_error_falls_and_a_stopped_training_goes_on(dim: list[Path], tmp_path: Path) -> None:
    steps: list[int] = []
    options = PairTraining(steps=20, batch=2, crop_px=64, warm=4, rate=6e-4, average=0.9)

    def tell(step: int, _: int, __: float) -> None:
        steps.append(step)
        if len(steps) == 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train_on_pairs(PHOTO, dim, tmp_path, SHIPPED, options, checkpoint_s=0.0, progress=tell)
    path = train_on_pairs(PHOTO, dim, tmp_path, SHIPPED, options, progress=tell)
    # The step in which it was stopped is made again.
    assert steps == [*range(1, 9), *range(8, 21)]
    network = PhotoNetwork()
    before = off(network, dim)
    network.load_state_dict({name: value.float() for name, value in load_file(path).items()})
    assert off(network, dim) < 0.7 * before
    assert path.stat().st_size < 9e6
    with pytest.raises(InputError, match="other options"):
        train_on_pairs(PHOTO, dim, tmp_path, SHIPPED, PairTraining(steps=13))
