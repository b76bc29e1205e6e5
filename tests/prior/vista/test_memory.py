"""What a run takes is told beforehand."""

from pathlib import Path

import pytest

from dreamdrive.errors import InputError
from dreamdrive.prior.vista.configs import config_of
from dreamdrive.prior.vista.keys import PARTS
from dreamdrive.prior.vista.kinds import VISTA
from dreamdrive.prior.vista.memory import LOOKING, Free, Job, check_memory, plan_memory
from dreamdrive.prior.vista.networks import make_empty
from dreamdrive.prior.vista.stored import StoredModel, StoredPart, open_weights
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
    assert 35e9 < half.steps["decoder"] < 50e9
    whole = plan_memory(official_size, Job(SIZE, 25, 25), half=False)
    assert whole.steps["UNet"] == pytest.approx(2 * half.steps["UNet"])
    assert whole.peak(shared=True) == whole.steps["decoder"] + whole.frames


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
        InputError, match=r"needs about 42\.9 GB at once .*8\.0 GB are free: give --size (\d+x\d+)"
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
