"""What a run takes is told beforehand."""

from pathlib import Path

import pytest
from tests.prior.vista.conftest import Golden

from dreamdrive.errors import InputError
from dreamdrive.prior.vista.configs import config_of
from dreamdrive.prior.vista.keys import PARTS, recipes_of
from dreamdrive.prior.vista.kinds import VISTA
from dreamdrive.prior.vista.memory import LEAST_CHUNK, plan_memory
from dreamdrive.prior.vista.stored import Stored, StoredPart, open_weights

SIZE = (1024, 576)


@pytest.fixture(scope="module")
def official_size(golden: Golden) -> Stored:
    import json

    keys = json.loads((golden.folder / "vista_checkpoint_keys.json").read_text())
    recipes = recipes_of(keys)
    parts = {}
    for part in PARTS:
        shapes = recipes.shapes(part, {key: tuple(shape) for key, shape in keys.items()})
        parts[part] = StoredPart(config_of(part, shapes), shapes, lambda name: pytest.fail(name))
    return Stored(Path("vista.safetensors"), VISTA, parts)


def test_the_official_model(official_size: Stored) -> None:
    half = plan_memory(official_size, SIZE, 25, 25, None, half=True)
    assert half.chunk == 14
    assert 7e9 < half.unet < 10e9
    assert 35e9 < half.decoder < 50e9
    whole = plan_memory(official_size, SIZE, 25, 25, None, half=False)
    assert whole.unet == pytest.approx(2 * half.unet)
    tight = plan_memory(official_size, SIZE, 25, 25, int(16e9), half=True)
    assert LEAST_CHUNK <= tight.chunk < 14
    assert tight.peak <= 16e9


def test_what_does_not_fit_is_refused_with_a_size_that_does(official_size: Stored) -> None:
    with pytest.raises(
        InputError, match=r"needs about 12\.\d GB .*8\.0 GB are free: give --size (\d+x\d+)"
    ) as told:
        plan_memory(official_size, SIZE, 25, 25, int(8e9), half=True)
    width, height = map(int, str(told.value).split("--size ")[1].split(" ")[0].split("x"))
    assert plan_memory(official_size, (width, height), 25, 25, int(8e9), half=True).peak <= 8e9
    with pytest.raises(InputError, match="no smaller size fits"):
        plan_memory(official_size, SIZE, 25, 25, int(1e9), half=True)


def test_a_tiny_model_fits_anywhere(vista_dir: Path) -> None:
    plan = plan_memory(open_weights(vista_dir), (64, 64), 8, 8, int(1e9), half=False)
    assert plan.chunk == 14
    assert plan.peak < 2e8
