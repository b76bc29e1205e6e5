"""A frame at a time the decoder makes what its own code makes of all at once."""

import pytest
import torch
from diffusers.models.autoencoders.autoencoder_kl_temporal_decoder import TemporalDecoder

from dreamdrive.prior.vista.decoder import decode_by_frames
from tests.living import Living


@pytest.fixture(scope="module")
def decoder() -> TemporalDecoder:
    torch.manual_seed(0)
    made = TemporalDecoder(block_out_channels=(32, 64, 64), layers_per_block=2).eval().requires_grad_(False)
    for name, value in made.named_parameters():
        if "norm" in name or "mix_factor" in name:
            value.normal_()
    return made


@pytest.mark.parametrize("count", [1, 2, 3, 7])
def test_frames_are_those_of_all_at_once(decoder: TemporalDecoder, count: int) -> None:
    latents = torch.randn(count, 4, 5, 9)
    expected = decoder(latents, torch.zeros(1, count), num_frames=count)
    torch.testing.assert_close(decode_by_frames(decoder, latents), expected, atol=2e-5, rtol=1e-4)
    if count > 1:
        alone = torch.cat([decode_by_frames(decoder, each) for each in latents.split(1)])
        assert (alone - expected).abs().max() > 1e-2


def test_two_maps_of_each_frame_live_at_once(decoder: TemporalDecoder) -> None:
    taken = []
    for count in (4, 12):
        with torch.no_grad(), Living() as living:
            decode_by_frames(decoder, torch.randn(count, 4, 8, 16))
        taken.append(living.peak)
    of_a_map = 32 * (8 * 4) * (16 * 4) * 4
    assert (taken[1] - taken[0]) / 8 == pytest.approx(2 * of_a_map, rel=0.02)
