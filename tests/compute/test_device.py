"""What a device can do."""

import pytest
import torch

from dreamdrive.compute.device import CPU, chosen_device, computing_on, device_of, has_bfloat16
from dreamdrive.errors import InputError


@pytest.mark.parametrize(
    ("capabilities", "has"),
    [
        ({"avx2": True, "avx512_bf16": False}, False),
        ({"avx512_bf16": True}, True),
        ({"amx_bf16": True}, True),
    ],
)
def test_a_processor_has_bfloat16_where_its_capabilities_say_so(
    monkeypatch: pytest.MonkeyPatch, capabilities: dict[str, bool], has: bool
) -> None:
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: capabilities, raising=False)
    assert has_bfloat16(CPU) is has


def test_an_older_torch_does_not_tell(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(torch.cpu, "get_capabilities", raising=False)
    assert not has_bfloat16(CPU)


@pytest.mark.parametrize("name", ["gpu", "cuda:", "cuda:x", "cuda:-1", "CUDA", "cuda:1234567", "mps", ""])
def test_other_names_are_refused(name: str) -> None:
    with pytest.raises(InputError, match="expected cpu, cuda, or one GPU of several such as cuda:1"):
        device_of(name, lambda: None)


def test_one_gpu_of_several(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.cuda, "device_count", lambda: 2)
    assert device_of("cuda:1", lambda: None) == torch.device("cuda", 1)
    assert device_of("cuda", lambda: None) == torch.device("cuda")
    with pytest.raises(InputError, match="--device cuda:2: torch finds 2, counted from cuda:0"):
        device_of("cuda:2", lambda: None)
    with pytest.raises(InputError, match="--device cuda:1: it is broken, or leave"):
        device_of("cuda:1", lambda: "it is broken")


def test_a_device_is_chosen_for_a_while() -> None:
    with pytest.raises(InputError), computing_on("cuda", lambda: "it is broken"):
        pass
    with computing_on("cpu") as there:
        assert chosen_device() == there == CPU
