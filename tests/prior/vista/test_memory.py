"""What a run takes is told beforehand."""

from pathlib import Path

import pytest
import torch
from torch.nn import functional

from dreamdrive.errors import InputError
from dreamdrive.prior.vista.configs import config_of
from dreamdrive.prior.vista.decoder import decode_by_frames
from dreamdrive.prior.vista.keys import PARTS
from dreamdrive.prior.vista.kinds import VISTA
from dreamdrive.prior.vista.memory import CHUNK, LOOKING, Free, Job, Step, check_memory, plan_memory
from dreamdrive.prior.vista.networks import make_empty
from dreamdrive.prior.vista.stored import StoredModel, StoredPart, open_weights
from tests.living import Living
from tests.prior.vista.tiny import OFFICIAL

SIZE = (1024, 576)


@pytest.fixture(scope="module")
def official_size() -> StoredModel:
    parts = {}
    for part in PARTS:
        state = make_empty(part, OFFICIAL[part], VISTA).state_dict()
        shapes = {name: tuple(value.shape) for name, value in state.items()}
        parts[part] = StoredPart(config_of(part, shapes), shapes, lambda name: pytest.fail(name))
    return StoredModel(Path("vista.safetensors"), VISTA, parts)


def test_the_official_model(official_size: StoredModel) -> None:
    half = plan_memory(official_size, Job(SIZE, 25, 25), half=True)
    assert 7e9 < half.steps["UNet"] < 10e9
    assert 12e9 < half.steps["decoder"] < 14e9
    assert half.fits(Free(int(15e9), int(20e9), shared=False))  # a GPU of 16 GB
    whole = plan_memory(official_size, Job(SIZE, 25, 25), half=False)
    assert whole.steps["UNet"] == pytest.approx(2 * half.steps["UNet"])
    assert whole.peak(shared=True) == whole.steps["UNet"] > whole.steps["decoder"] + whole.frames


@pytest.mark.parametrize("size", [SIZE, (576, 320)])
def test_plans_are_what_lives_at_once(
    official_size: StoredModel, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Counted while the networks run on the meta device; without the margin, and without the weights."""
    monkeypatch.setattr(functional, "scaled_dot_product_attention", lambda query, *_, **__: query.clone())
    width, height = size[0] // 8, size[1] // 8
    unet, vae = (make_empty(part, OFFICIAL[part], VISTA).to("meta") for part in ("unet", "vae"))
    context = OFFICIAL["unet"]["cross_attention_dim"]
    counted: dict[Step, int] = {}
    with torch.no_grad():
        with Living() as living:
            given = (torch.empty(shape, device="meta") for shape in ((1, 1, context), (1, 3)))
            unet(torch.empty(1, 25, 8, height, width, device="meta"), 0.5, *given)
        counted["UNet"] = living.peak
        with Living() as living:
            vae.encode(torch.empty(1, 3, *size[::-1], device="meta"))
        counted["encoder"] = living.peak
        with Living() as living:
            decode_by_frames(vae.decoder, torch.empty(CHUNK, 4, height, width, device="meta"))
        counted["decoder"] = living.peak
    plan = plan_memory(official_size, Job(size, 25, 25), half=False)
    for step, count in counted.items():
        own = official_size.parts["unet" if step == "UNet" else "vae"]
        assert plan.steps[step] == pytest.approx(4 * own.count + 1.25 * count, rel=0.02), step


def test_frames_lie_in_main_memory(official_size: StoredModel) -> None:
    """More of them take no more of the GPU, whose memory does not count for them."""
    few, many = (plan_memory(official_size, Job(SIZE, n, 25), half=True) for n in (25, 927))
    assert few.steps == many.steps
    assert many.frames == pytest.approx(927 / 25 * few.frames)
    assert many.fits(Free(int(50e9), int(20e9), shared=False))
    assert not many.fits(Free(int(50e9), int(5e9), shared=False))
    assert many.fits(Free(None, None, shared=False))
    with pytest.raises(InputError, match=r"5\.0 GB of main memory are free: .*, or fewer --frames"):
        check_memory(official_size, Job(SIZE, 927, 25), Free(int(50e9), int(5e9), shared=False), half=True)


def test_what_does_not_fit_is_refused_with_a_size_that_does(official_size: StoredModel) -> None:
    with pytest.raises(
        InputError, match=r"needs about 13\.1 GB at once .*8\.0 GB are free: give --size (\d+x\d+)"
    ) as told:
        check_memory(official_size, Job(SIZE, 25, 25), Free(int(8e9)), half=True)
    width, height = map(int, str(told.value).split("--size ")[1].split(" ")[0].split("x"))
    check_memory(official_size, Job((width, height), 25, 25), Free(int(8e9)), half=True)
    with pytest.raises(InputError, match="no smaller size fits"):
        check_memory(official_size, Job(SIZE, 25, 25), Free(int(1e9)), half=True)


def test_features_need_no_decoder(official_size: StoredModel) -> None:
    check_memory(official_size, Job(SIZE, 300, 25, LOOKING), Free(int(12e9)), half=True)


def test_a_tiny_model_fits_anywhere(vista_dir: Path) -> None:
    plan = plan_memory(open_weights(vista_dir), Job((64, 64), 8, 8), half=False)
    assert plan.peak(shared=True) < 2e8
