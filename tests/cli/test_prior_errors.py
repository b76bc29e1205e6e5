"""What is wrong with a prior's input is one message, and nothing is written."""

from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from safetensors.torch import save_file

from dreamdrive.data.layout_file import write_layout
from dreamdrive.prior.vista.kinds import SVD, VISTA
from streetworld import draw_street
from tests.cli.conftest import Run
from tests.prior.magicdrive.tiny import write_folder
from tests.prior.vista.photos import save_photo
from tests.prior.vista.tiny import official, save_official

Arguments = list[object]


def vista(folder: Path, weights: Path, *more: object, width: int = 160) -> Arguments:
    return [save_photo(folder / "photo.png", width, 90), "--prior", "vista", "--weights", weights, *more]


def wrong(folder: Path) -> Arguments:
    save_file({"layer.weight": torch.zeros(2)}, folder / "wrong.safetensors")
    return vista(folder, folder / "wrong.safetensors", "--size", "64x64")


def truncated(folder: Path) -> Arguments:
    file = save_official(folder / "vista.safetensors", VISTA)
    file.write_bytes(file.read_bytes()[:-100])
    return vista(folder, file, "--size", "64x64")


def other_model(folder: Path) -> Arguments:
    return vista(folder, save_official(folder / "svd.safetensors", SVD), "--size", "64x64")


def missing_group(folder: Path) -> Arguments:
    state = {key: value.contiguous() for key, value in official(VISTA).items()}
    state = {key: value for key, value in state.items() if "action_control" not in key}
    save_file(state, folder / "vista.safetensors")
    return vista(folder, folder / "vista.safetensors", "--size", "64x64")


def small_photo(folder: Path) -> Arguments:
    return vista(folder, save_official(folder / "vista.safetensors", VISTA))


def far_action(folder: Path) -> Arguments:
    return vista(folder, folder, "--action", "ahead=4,8,12,900 right=0,0,0,0")


def wrong_goal(folder: Path) -> Arguments:
    return vista(folder, folder, "--action", "goal=0.5,1.5")


def bare_layout(folder: Path) -> Arguments:
    street = draw_street(3)
    write_layout(type(street)(street.ego), folder / "bare.json")
    weights = write_folder(folder / "weights").path
    return [folder / "bare.json", "--prior", "magicdrive", "--weights", weights]


@pytest.mark.parametrize("command", [("generate",), ("prior", "sample")], ids=["generate", "sample"])
@pytest.mark.parametrize(
    ("given", "message"),
    [
        (wrong, "holds unknown tensors: layer.weight; expected vista.safetensors"),
        (truncated, "is no .safetensors or is cut short"),
        (other_model, "holds Stable Video Diffusion, not Vista: use --prior svd"),
        (missing_group, "the action adapters (all of it) is missing"),
        (small_photo, "photo.png is 160x90 pixels: too small for 1024x576"),
        (far_action, "an action outside its range: ahead_m is 900; expected -1 to 100"),
        (wrong_goal, "an action outside its range: row is 1.5; expected 0 to 1"),
        (bare_layout, "bare.json: no area is of kind road"),
    ],
)
def test_one_message_and_exit_2(
    run: Run, tmp_path: Path, command: tuple[str, ...], given: Callable[[Path], Arguments], message: str
) -> None:
    result = run(*command, *given(tmp_path), "-o", tmp_path / "out")
    assert result.code == 2
    assert result.err.startswith("error: ")
    assert result.err.count("error: ") == 1
    assert message in result.err
    assert not (tmp_path / "out" / "scene").exists()
    assert not (tmp_path / "out" / "provenance.json").exists()
