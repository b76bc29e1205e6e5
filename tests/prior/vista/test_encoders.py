"""The two encoders of an official file."""

from pathlib import Path

import pytest
import torch
from safetensors.torch import save_file
from torch import Tensor

from dreamdrive.errors import InputError
from dreamdrive.prior.vista.convert import convert
from dreamdrive.prior.vista.kinds import VISTA
from dreamdrive.prior.vista.stored import SECOND, encoder_difference, notes_of, open_weights
from tests.prior.vista.tiny import official


@pytest.fixture
def state() -> dict[str, Tensor]:
    return {key: value.contiguous() for key, value in official(VISTA).items()}


def saved(path: Path, state: dict[str, Tensor]) -> Path:
    save_file(state, path)
    return path


def test_one_encoder_may_do_the_work_of_both(vista_file: Path) -> None:
    difference = encoder_difference(vista_file)
    assert difference is not None
    assert difference < 1e-6
    assert notes_of(open_weights(vista_file)) == []


@pytest.mark.parametrize("name", ["conv_in.weight", "conv_out.bias", "mid.block_1.conv1.weight"])
def test_another_encoder_is_said_and_stays_said(tmp_path: Path, state: dict[str, Tensor], name: str) -> None:
    state[SECOND + name] = 1.2 * state[SECOND + name]
    made = convert(saved(tmp_path / "other.safetensors", state), tmp_path / "model")
    assert len(made.notes) == 1
    assert "encoders of other.safetensors differ, by up to" in made.notes[0]
    assert notes_of(open_weights(tmp_path / "model")) == made.notes


def test_without_a_second_encoder_nothing_is_said(tmp_path: Path, state: dict[str, Tensor]) -> None:
    one = {key: value for key, value in state.items() if not key.startswith(SECOND)}
    assert encoder_difference(saved(tmp_path / "one.safetensors", one)) is None


def test_an_encoder_of_another_form_is_refused(tmp_path: Path, state: dict[str, Tensor]) -> None:
    for change in (None, torch.zeros(3)):
        changed = dict(state)
        changed.pop(f"{SECOND}conv_in.bias")
        if change is not None:
            changed[f"{SECOND}conv_in.bias"] = change
        with pytest.raises(InputError, match=r"of different forms \(conv_in.bias\)"):
            encoder_difference(saved(tmp_path / "form.safetensors", changed))
