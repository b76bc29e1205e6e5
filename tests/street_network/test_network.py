from pathlib import Path

import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.evaluate.networks.efficientnet_lite import FILE
from dreamdrive.street_network import StreetNetwork
from dreamdrive.street_network.decoder import CameraVotes, line_through, places
from dreamdrive.street_network.encoder import CHANNELS, Encoder, read_encoder


def drawn(seed: int = 0) -> StreetNetwork:
    torch.manual_seed(seed)
    return StreetNetwork()


def test_what_it_answers_has_the_sizes_that_the_prediction_says() -> None:
    with torch.inference_mode():
        said = drawn().eval()(torch.rand(2, 3, 64, 96))
    assert said.log_depth.shape == said.log_spread.shape == (2, 32, 48)
    assert said.classes.shape == (2, 11, 32, 48)
    assert said.centre.shape == (2, 3, 16, 24)
    assert said.offset.shape == (2, 2, 16, 24)
    assert said.camera.shape == (2, 7)
    assert said.of(1).camera.equal(said.camera[1:])


def test_it_is_small() -> None:
    assert sum(each.numel() for each in drawn().parameters()) < 4e6


def test_sides_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match="multiples of 32"):
        drawn()(torch.rand(1, 3, 60, 96))


def test_features_of_all_strides() -> None:
    with torch.inference_mode():
        features = Encoder().eval()(torch.rand(1, 3, 64, 96))
    assert [each.shape[1] for each in features] == list(CHANNELS)
    assert [64 // each.shape[2] for each in features] == [2, 4, 8, 16, 32]


def test_folded_norms_answer_the_same() -> None:
    network = drawn()
    pictures = torch.rand(2, 3, 64, 64)
    with torch.no_grad():
        for _ in range(3):
            network.train()(pictures)  # norms that are no longer those of the start
        plain, folded = network.eval()(pictures), network.folded()(pictures)
    assert not any("norm" in key for key in network.folded().state_dict())
    torch.testing.assert_close(folded.log_depth, plain.log_depth, rtol=1e-4, atol=1e-4)
    torch.testing.assert_close(folded.camera, plain.camera, rtol=1e-4, atol=1e-4)


def test_low_precision_answers_about_the_same() -> None:
    network, pictures = drawn().eval(), torch.rand(1, 3, 64, 64)
    with torch.inference_mode():
        plain = network(pictures)
        with torch.autocast("cpu", torch.bfloat16):
            low = network(pictures)
    assert low.log_depth.dtype == torch.float32
    torch.testing.assert_close(low.log_depth, plain.log_depth, rtol=0.05, atol=0.05)


def test_the_encoder_takes_the_weights_of_the_package() -> None:
    path = FILE.locate()
    theirs = torch.load(path, weights_only=True)
    ours = read_encoder(path)
    torch.testing.assert_close(ours["stem.conv.weight"], theirs["_conv_stem.weight"])
    torch.testing.assert_close(ours["blocks.3.filter.norm.running_var"], theirs["_blocks.3._bn1.running_var"])
    assert len(ours) == len([key for key in theirs if not key.startswith(("_conv_head", "_bn1.", "_fc"))])


def test_a_line_through_votes_has_the_horizon_and_the_roll() -> None:
    votes = CameraVotes(8)
    features = torch.rand(2, 8, 6, 10)
    across, down = places(features).flatten(2).unbind(dim=1)
    share = torch.rand(2, 60).softmax(dim=1)
    height, slope = line_through(across, 0.03 - 0.05 * across, share)
    torch.testing.assert_close(height, torch.full((2,), 0.03), atol=2e-3, rtol=0)
    torch.testing.assert_close(slope, torch.full((2,), -0.05), atol=2e-3, rtol=0)
    assert float(down.max()) == pytest.approx(0.25)
    assert votes.eval()(features).shape == (2, 7)


def test_weights_of_something_else_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.pth"
    torch.save({"_conv_stem.weight": torch.zeros(32, 3, 3, 3)}, path)
    with pytest.raises(InputError, match="efficientnet-lite0"):
        read_encoder(path)
