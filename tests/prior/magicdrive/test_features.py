"""What the UNet sees in its own pictures, and that it reaches the Gaussians."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from dreamdrive.build import build_scene
from dreamdrive.data.layout_file import write_layout
from dreamdrive.options import QUALITIES
from dreamdrive.prior import choose_prior
from dreamdrive.prior.early_features import BLOCK, SIGMA, onto_frames, watch
from dreamdrive.prior.magicdrive.condition import OfLayout, see
from dreamdrive.prior.magicdrive.features import activations, nearest_time
from dreamdrive.prior.magicdrive.folder import read_parts
from dreamdrive.prior.magicdrive.networks import denoised
from dreamdrive.prior.magicdrive.sample import unipc
from dreamdrive.progress import Work
from dreamdrive.scene.clip import OF_GEOMETRY, Clip
from dreamdrive.scene.control import Control
from dreamdrive.scene.gaussians import Gaussians
from streetworld import draw_street
from tests.prior.magicdrive.tiny import SIZE, Written

NAME = f"magicdrive:{BLOCK}"


@pytest.fixture(scope="module")
def control(written: Written, tmp_path_factory: pytest.TempPathFactory) -> Control:
    layout = tmp_path_factory.mktemp("layout") / "street.json"
    write_layout(draw_street(3), layout)
    return Control(layout, weights=written.path, frames="0:2", steps=1, fps=0.5)


@pytest.fixture(scope="module")
def clip(control: Control) -> Clip:
    return choose_prior("magicdrive")(control)


def test_features_lie_on_the_frames_and_differ(clip: Clip) -> None:
    values = clip.features[NAME].astype(np.float32)
    count, height, width, channels = values.shape
    assert (count, channels, clip.features[NAME].dtype) == (12, 16, np.float16)
    assert SIZE[0] % width == SIZE[1] % height == 0
    assert values[..., 0].std() > 0.3
    apart = np.abs(values[:, None] - values[None]).max(axis=(2, 3, 4))
    assert (apart[~np.eye(12, dtype=bool)] > 1e-2).all()
    assert "resized from 6x3" in clip.provenance["notes"][-1]


def test_equal_seeds_give_equal_features(clip: Clip, control: Control) -> None:
    again = choose_prior("magicdrive")(control)
    np.testing.assert_array_equal(again.features[NAME], clip.features[NAME])
    other = choose_prior("magicdrive")(replace(control, seed=1))
    assert (other.features[NAME] != clip.features[NAME]).any()


def test_they_reach_the_seeds(clip: Clip) -> None:
    """Z_ref of a Gaussian is what geometry gives, then all features of the clip by name."""
    made = list[Gaussians]()

    def run(name: str, options: object, compute: Callable[[Work], Any], **given: Any) -> Any:
        result = compute(Work())
        if name == "initialise":
            made.append(result)
            raise KeyboardInterrupt
        return result

    with pytest.raises(KeyboardInterrupt):
        build_scene(clip, replace(QUALITIES["draft"], knowledge="none"), run=run)
    features = made[0].features
    assert features is not None
    assert features.shape == (len(made[0]), OF_GEOMETRY + 15 + 16)
    last = features[:, -16:]
    assert torch.isfinite(last).all()
    assert (last.std(dim=0) > 0).all()


def test_the_map_takes_no_part(written: Written) -> None:
    """The ControlNet's residuals do not pass through the block, so that it need not run."""
    parts = read_parts(written.path, temporal=False)
    seen = see(OfLayout(draw_street(3)), np.zeros(1), parts.settings.map_shape[1], parts.words("Rain"))
    latents = torch.randn(6, *parts.latent_shape, generator=torch.Generator().manual_seed(0))
    words, time = parts.controlnet.tokens(seen), torch.tensor(50)
    with torch.inference_mode():
        residuals = parts.controlnet.residuals(latents, time, words, seen.raster)
        caught = list[torch.Tensor]()
        handle = watch(parts.unet, BLOCK, caught.append)
        for given in (residuals, None):
            denoised(parts.unet, latents, time, words, given)
        handle.remove()
    assert torch.equal(*caught)
    schedule = unipc(parts.scheduler, 1).alphas_cumprod
    values = activations(parts, seen, latents, schedule, 0)
    assert values.shape == (6, 3, 6, 16)
    bare = replace(seen, present=torch.zeros_like(seen.present), cameras=torch.zeros_like(seen.cameras))
    assert (activations(parts, bare, latents, schedule, 0) != values).any()


def test_the_noise_is_that_of_other_video_models() -> None:
    table = {"num_train_timesteps": 1000, "beta_start": 0.00085, "beta_end": 0.012}
    kept = unipc(table | {"beta_schedule": "scaled_linear"}, 1).alphas_cumprod
    time = nearest_time(kept)
    assert ((1 - kept[time]) / kept[time]).sqrt() == pytest.approx(SIGMA, rel=0.01)


def test_features_of_the_published_sizes_need_no_resizing_where_16_divides() -> None:
    for size, grid in (((400, 224), (14, 25)), ((736, 272), (17, 46))):
        values = np.zeros((1, *grid, 3), dtype=np.float16)
        assert onto_frames(values, size) == (values, ())
    resized, said = onto_frames(np.zeros((1, 27, 50, 3), dtype=np.float16), (800, 424))
    assert resized.shape == (1, 53, 50, 3)
    assert "from 50x27 to 50x53" in said[0]
