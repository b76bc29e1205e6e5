from pathlib import Path

import pytest
import torch
from safetensors.torch import save_file

from dreamdrive.errors import InputError
from dreamdrive.street_network import StreetNetwork, load_knowledge
from dreamdrive.street_network.weights import Training, read_network, write_network

SAID = Training(10, 3, "abc", {"drawn": "00"}, {"miou": 0.5}, "Apache-2.0")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    torch.manual_seed(0)
    write_network(StreetNetwork(), SAID, tmp_path / "street.safetensors")
    return tmp_path / "street.safetensors"


def test_weights_come_back_with_what_they_come_from(path: Path) -> None:
    torch.manual_seed(0)
    wanted = StreetNetwork().eval()
    network, said = read_network(path)
    assert said == SAID
    assert path.stat().st_size < 8.5e6
    pictures = torch.rand(1, 3, 64, 64)
    with torch.inference_mode():
        torch.testing.assert_close(
            network(pictures).log_depth, wanted(pictures).log_depth, rtol=0.01, atol=0.01
        )
        torch.testing.assert_close(
            load_knowledge(path)(pictures).classes, network(pictures).classes, rtol=1e-3, atol=1e-3
        )


def test_a_file_without_its_origin_is_refused(tmp_path: Path) -> None:
    save_file({"a": torch.zeros(1)}, tmp_path / "a.safetensors")
    with pytest.raises(InputError, match="does not say what it was trained on"):
        load_knowledge(tmp_path / "a.safetensors")


def test_a_file_of_another_kind_is_refused(path: Path, tmp_path: Path) -> None:
    other = Training(1, 0, "", {}, {}, "", kind="something else")
    write_network(StreetNetwork(), other, tmp_path / "b.safetensors")
    with pytest.raises(InputError, match="something else"):
        load_knowledge(tmp_path / "b.safetensors")


def test_a_damaged_file_is_refused(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(InputError, match="damaged"):
        load_knowledge(path)


def test_no_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no such file; expected street, or a file of weights"):
        load_knowledge(tmp_path / "none.safetensors")
