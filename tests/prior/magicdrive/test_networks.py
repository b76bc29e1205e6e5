"""The networks against upstream's numbers and against the key lists of the published folders."""

import copy
from dataclasses import replace
from typing import Any

import pytest
import torch
from diffusers.models.attention import BasicTransformerBlock
from diffusers.models.unets.unet_2d_condition import UNet2DConditionModel
from diffusers.schedulers.scheduling_unipc_multistep import UniPCMultistepScheduler
from safetensors.torch import load_file
from torch import Tensor

from dreamdrive.prior.magicdrive.blocks import TemporalBlock, sparse_causal
from dreamdrive.prior.magicdrive.condition import Conditions
from dreamdrive.prior.magicdrive.config import Temporal, parse_settings, read_settings
from dreamdrive.prior.magicdrive.folder import needed_bytes
from dreamdrive.prior.magicdrive.networks import BevControlNet, MapEncoder, denoised, fourier, multiview_unet
from dreamdrive.prior.magicdrive.sample import sample, unipc
from tests.golden import reading
from tests.golden.reading import Table, cases, close, tensors, values
from tests.prior.magicdrive.tiny import SIZE, Written, official_configs

FEATURES = 1e-5
"""Limit of features and tokens, of the largest value: sines of metres times 8, rounded to 1e-6."""
NETWORK = 3e-5
"""Limit of one pass, of the largest value; upstream's own code on a changed input of 1e-6 moves by 1e-5."""
RUN = 1e-4
"""Limit of a whole run, of the largest value: as many passes, each on the rounding of those before."""
CONFIG, STATE = "magicdrive/tiny_config.json", "magicdrive/tiny_state_fp16.safetensors"


@pytest.fixture(scope="module")
def golden() -> Table:
    """``in.*`` and ``out.*`` of one pass and of whole runs."""
    return tensors("magicdrive/forward.safetensors")


@pytest.fixture(scope="module")
def networks() -> tuple[UNet2DConditionModel, BevControlNet]:
    """For any shape of map and pictures, which a user's folder may not have."""
    configs = values(CONFIG)
    settings = parse_settings(configs["unet"], configs["controlnet"])
    unet = multiview_unet(configs["unet"], settings)
    controlnet = BevControlNet(configs["controlnet"], settings)
    state = {key: value.float() for key, value in tensors(STATE).items()}
    for name, network in (("unet.", unet), ("controlnet.", controlnet)):
        own = {k.removeprefix(name): v for k, v in state.items() if k.startswith(name)}
        missing, unexpected = network.load_state_dict(own, strict=False)
        assert not unexpected
        assert reading.is_cut() or not missing
        network.eval().requires_grad_(False)
    return unet, controlnet


@pytest.fixture(scope="module")
def conditions(golden: Table) -> Conditions:
    names = ("bev_map", "camera_param", "bboxes", "classes", "masks", "text")
    raster, cameras, corners, classes, masks, text = (golden[f"in.{name}"] for name in names)
    return Conditions(raster, cameras, corners, classes, masks.bool(), text)


def tokens(controlnet: BevControlNet, c: Conditions) -> Tensor:
    return controlnet.tokens(c)


def test_golden_embedders(networks, conditions, golden) -> None:
    _, controlnet = networks
    boxes = controlnet.bbox_embedder(conditions.corners_m, conditions.classes, conditions.present)
    found = {
        "cam_fourier": fourier(conditions.cameras.transpose(-1, -2)).flatten(-2),
        "fourier_points": fourier(conditions.corners_m),
        "cam_token": controlnet.camera_tokens(conditions.cameras),
        "bbox_tokens": boxes,
        "map_feat": controlnet.controlnet_cond_embedding(conditions.raster),
        "uncond_cam": controlnet.null_camera[None, None],
        "ehs": tokens(controlnet, conditions),
    }
    for name, value in found.items():
        close(value, golden[f"out.{name}"], FEATURES, name)


def test_golden_tokens_without_any_box(networks, conditions, golden) -> None:
    none = {"corners_m": conditions.corners_m[:, :, :0], "classes": conditions.classes[:, :, :0]}
    bare = replace(conditions, present=conditions.present[:, :, :0], **none)
    close(tokens(networks[1], bare), golden["out.nobox_ehs"], FEATURES)


def one_pass(networks, c: Conditions, latents: Tensor, times: Tensor) -> tuple[Tensor, Tensor]:
    """Noise (b, n, ...) with and without the residuals of the ControlNet."""
    unet, controlnet = networks
    b, n = latents.shape[:2]
    flat, each = latents.flatten(0, 1), times.repeat_interleave(n)
    words = tokens(controlnet, c)
    residuals = controlnet.residuals(flat, each, words, c.raster)
    noise = [denoised(unet, flat, each, words, given) for given in (residuals, None)]
    return noise[0].unflatten(0, (b, n)), noise[1].unflatten(0, (b, n))


def test_golden_residuals(networks, conditions, golden) -> None:
    latents, times = golden["in.latents"], golden["in.timesteps"]
    words, n = tokens(networks[1], conditions), latents.shape[1]
    down, middle = networks[1].residuals(
        latents.flatten(0, 1), times.repeat_interleave(n), words, conditions.raster
    )
    found = {f"cn_down.{index}": residual for index, residual in enumerate(down)} | {"cn_mid": middle}
    expected = {name: value for name, value in golden.under("out.").items() if name.startswith("cn_")}
    assert reading.is_cut() or found.keys() == expected.keys()
    for name, value in expected.items():
        close(found[name], value, NETWORK, name)


def test_golden_pass(networks, conditions, golden) -> None:
    expected = golden["out.unet"], golden["out.unet_noresidual"]
    found = one_pass(networks, conditions, golden["in.latents"], golden["in.timesteps"])
    for noise, wanted in zip(found, expected, strict=True):
        close(noise, wanted, NETWORK)


@pytest.mark.parametrize(("zero_map", "name"), [(True, "pipe_zeromap"), (False, "pipe_samemap")])
def test_golden_run(networks, conditions, golden, zero_map: bool, name: str) -> None:
    unet, controlnet = networks
    expected = golden[f"out.{name}"]
    free = conditions.without(controlnet.null_camera, golden["in.neg_text"], zero_map=zero_map)
    close(free.cameras, golden["out.uncond_camera_param"], FEATURES)
    scheduler = unipc(values(CONFIG)["scheduler"], len(golden["out.pipe_timesteps"]))
    assert torch.equal(scheduler.timesteps, golden["out.pipe_timesteps"])
    b, n = expected.shape[:2]
    noise = golden["in.pipe_latents0"].repeat_interleave(n, dim=0)
    latents = sample(unet, controlnet, (conditions, free), noise, scheduler)
    close(latents.unflatten(0, (b, n)), expected, RUN)


@pytest.mark.parametrize("steps", cases("magicdrive/unipc_scheduler.safetensors", r"trace_(\d+)"))
def test_golden_scheduler(steps: str) -> None:
    traces = tensors("magicdrive/unipc_scheduler.safetensors")
    scheduler = unipc(values(CONFIG)["scheduler"], int(steps))
    assert torch.equal(scheduler.timesteps, traces[f"timesteps_{steps}"])
    latents = traces["x0"]
    for time, wanted in zip(scheduler.timesteps, traces[f"trace_{steps}"][1:], strict=True):
        made: Any = scheduler.step(0.9 * latents + 0.0005 * time, time, latents, return_dict=False)
        latents = made[0]
        close(latents, wanted, FEATURES)


BLOCKS = "magicdrive/temporal_block.safetensors"


@pytest.mark.parametrize("kind", cases(BLOCKS, r"(\w+)\.out"))
def test_golden_temporal_block(kind: str) -> None:
    about, stored = values("magicdrive/temporal_block.json"), tensors(BLOCKS).under(f"{kind}.")
    state = stored.under("state.")
    plain = BasicTransformerBlock(
        about["dim"], about["heads"], about["dim_head"], cross_attention_dim=about["cross_attention_dim"]
    )
    connector, positions = "temp_connector.weight" in state, "pos_emb.param" in state
    temporal = Temporal(about["video_length"], False, connector, positions)
    block = TemporalBlock(plain, about["cams"], temporal)
    if kind.startswith("s_ff"):
        block.sources = about["sc_attn_index"]
    block.load_state_dict(state)
    close(block(stored["in.x"], encoder_hidden_states=stored["in.ehs"]), stored["out"], NETWORK)


def test_the_published_key_frames() -> None:
    sixteen = [[0, 0, 6, 12], *[[0, 6, f - 1, f] for f in range(1, 6)], [0, 6, 6, 12]]
    sixteen += [*[[6, 12, f - 1, f] for f in range(7, 12)], [0, 6, 12, 12]]
    sixteen += [[6, 12, f - 1, f] for f in range(13, 16)]
    assert sparse_causal(16) == sixteen
    sixty = sparse_causal(61)
    assert sixty[:12] == sixteen[:12]
    assert [sixty[f] for f in (12, 13, 54, 59, 60)] == [
        [6, 12, 12, 18],
        [12, 18, 12, 13],
        [48, 54, 54, 60],
        [54, 60, 58, 59],
        [54, 60, 60, 60],
    ]


@pytest.fixture(scope="module")
def official() -> Table:
    return values("magicdrive/magicdrive_checkpoint_keys.json")


def shapes(network: torch.nn.Module) -> dict[str, list[int]]:
    return {key: list(value.shape) for key, value in network.state_dict().items()}


def test_golden_keys_of_the_published_folders(official) -> None:
    unet, controlnet = official_configs()
    settings = read_settings(unet, controlnet)
    with torch.device("meta"):
        assert shapes(multiview_unet(unet, settings)) == official["unet"]
        assert shapes(BevControlNet(controlnet, settings)) == official["controlnet"]


def test_golden_keys_of_the_temporal_variant_are_eight_more_a_block(official) -> None:
    unet, controlnet = official_configs(temporal=True)
    with torch.device("meta"):
        found = shapes(multiview_unet(unet, read_settings(unet, controlnet)))
    new = {key: shape for key, shape in found.items() if key not in official["unet"]}
    assert {k: v for k, v in found.items() if k not in new} == official["unet"]
    first = "down_blocks.0.attentions.0.transformer_blocks.0."
    assert {key.removeprefix(first): shape for key, shape in new.items() if key.startswith(first)} == {
        "pos_emb.param": [1, 16, 320],
        "temp_norm.weight": [320],
        "temp_norm.bias": [320],
        **{f"temp_attn.{name}.weight": [320, 320] for name in ("to_q", "to_k", "to_v", "to_out.0")},
        "temp_attn.to_out.0.bias": [320],
    }
    assert len(new) == 16 * 8


@pytest.mark.parametrize(
    ("cells", "pooled", "size"), [(200, None, (28, 50)), (400, None, (53, 100)), (200, (34, 92), (34, 92))]
)
def test_the_map_becomes_the_size_of_the_latents(cells: int, pooled: Any, size: tuple[int, int]) -> None:
    with torch.device("meta"):
        encoder = MapEncoder(8, (16, 32, 96, 256), 320, pooled)
        assert encoder(torch.zeros(1, 8, cells, cells)).shape == (1, 320, *size)
    assert [key for key in encoder.state_dict() if key.startswith("blocks.6")] == []


@pytest.fixture(scope="module")
def tiny(written: Written) -> tuple[UNet2DConditionModel, BevControlNet]:
    settings = read_settings(written.unet, written.controlnet)
    found = multiview_unet(written.unet, settings), BevControlNet(written.controlnet, settings)
    for network, part in zip(found, ("unet", "controlnet"), strict=True):
        network.load_state_dict(load_file(written.weights(part)))
        network.eval().requires_grad_(False)
    return found


@pytest.fixture(scope="module")
def drawn(tiny) -> tuple[Conditions, Tensor, Tensor]:
    """Conditions of two time steps and six cameras, words of none of them, and latents."""
    draw = torch.Generator().manual_seed(1)
    width = tiny[1].cam2token.out_features

    def normal(*shape: int) -> Tensor:
        return torch.randn(shape, generator=draw)

    raster = (normal(2, 8, 200, 200) > 1).float()
    present = normal(2, 6, 4) > 0
    given = Conditions(
        raster,
        normal(2, 6, 3, 7),
        3 * normal(2, 6, 4, 8, 3),
        torch.randint(10, (2, 6, 4), generator=draw),
        present,
        normal(2, 5, width),
    )
    return given, normal(2, 5, width), normal(2, 6, 4, SIZE[1] // 4, SIZE[0] // 4)


def test_half_precision_runs_close_to_single(tiny, drawn) -> None:
    """Half a step: weights are exact in half precision, cameras and corners are read in single."""
    made: list[Tensor] = []
    given, no_words, latents = drawn
    exact = [copy.deepcopy(each).half().float() for each in tiny]
    for dtype in (torch.float32, torch.float16):
        unet, controlnet = (torch.nn.Module.to(copy.deepcopy(each), dtype) for each in exact)
        free = given.without(controlnet.null_camera.float(), no_words)
        made.append(sample(unet, controlnet, (given, free), latents.flatten(0, 1), scheduler_of(1)))
    assert made[1].dtype == torch.float32
    difference = (made[1] - made[0]).abs().max() / made[0].std()
    assert 0 < difference < 0.02


def scheduler_of(steps: int) -> UniPCMultistepScheduler:
    return unipc(
        {"num_train_timesteps": 1000, "beta_start": 0.00085, "beta_end": 0.012, "beta_schedule": "linear"},
        steps,
    )


@pytest.mark.parametrize(
    ("temporal", "element_bytes", "gigabytes"),
    [(False, 4, 7.5), (False, 2, 4.3), (True, 4, 12.9), (True, 2, 6.9)],
)
def test_the_memory_of_the_published_models(temporal: bool, element_bytes: int, gigabytes: float) -> None:
    unet, controlnet = official_configs(temporal)
    settings = read_settings(unet, controlnet)
    with torch.device("meta"):
        networks = [multiview_unet(unet, settings), BevControlNet(controlnet, settings)]
        others = torch.nn.Linear(206_714_431, 1)  # as many parameters as text encoder and autoencoder have
    needed = needed_bytes([*networks, others], settings, 320, element_bytes)
    assert needed / 1e9 == pytest.approx(gigabytes, abs=0.06)


def test_the_ring_may_start_at_any_camera(tiny, drawn) -> None:
    """Which is why our list can start at the front camera, where MagicDrive's starts on its left."""
    given, _, latents = drawn
    names = ("cameras", "corners_m", "classes", "present")
    moved = replace(given, **{name: getattr(given, name).roll(-1, dims=1) for name in names})
    times = torch.tensor([10, 500])
    noise, _ = one_pass(tiny, given, latents, times)
    turned, _ = one_pass(tiny, moved, latents.roll(-1, dims=1), times)
    close(turned.roll(1, dims=1), noise, NETWORK)
