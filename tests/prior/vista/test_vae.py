"""The autoencoder against the public code."""

from dreamdrive.prior.vista.decoder import decode_by_frames
from tests.golden.reading import close, tensors
from tests.prior.vista.networks import build

LIMIT = 3e-5
"""Of the largest value; the same library in float32 differs by 4e-6 from the public code."""


def test_golden_frames_there_and_back() -> None:
    given = tensors("vista/vae.safetensors")
    state = tensors("vista/tiny_vae_state_fp16.safetensors")
    vae = build("vae", {k: v.float() for k, v in state.items()})
    coded = vae.encode(given["image"]).latent_dist
    close(coded.parameters, given["moments"], LIMIT)
    close(coded.mode(), given["mode"], LIMIT)
    frames = vae.decode(given["z"], num_frames=len(given["z"])).sample
    close(frames, given["frames"], LIMIT)
    close(decode_by_frames(vae.decoder, given["z"]), given["frames"], LIMIT)
