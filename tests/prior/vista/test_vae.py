"""The autoencoder against the public code."""

import torch
from tests.prior.vista.conftest import Golden
from tests.prior.vista.golden import build


def test_golden_frames_there_and_back(golden: Golden) -> None:
    given = golden.tensors("vae")
    vae = build("vae", {k: v.float() for k, v in golden.tensors("tiny_vae_state_fp16").items()})
    coded = vae.encode(given["image"]).latent_dist
    torch.testing.assert_close(coded.parameters, given["moments"], atol=1e-5, rtol=0)
    torch.testing.assert_close(coded.mode(), given["mode"], atol=1e-5, rtol=0)
    frames = vae.decode(given["z"], num_frames=len(given["z"])).sample
    torch.testing.assert_close(frames, given["frames"], atol=1e-5, rtol=0)
