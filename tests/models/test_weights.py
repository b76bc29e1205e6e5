"""What is wrong with a file of weights is said by name."""

import os
import zipfile
from argparse import Namespace
from pathlib import Path

import pytest
import torch
from torch import nn

from dreamdrive.errors import InputError
from dreamdrive.models import weights
from dreamdrive.models.weights import check_sizes, fill, fill_network, load_network, read_torch


class Small(nn.Module):
    def __init__(self) -> None:
        super().__init__()
        self.layer = nn.Linear(2, 3)
        self.bn = nn.BatchNorm1d(3)


def saved(folder: Path, **changes: object) -> Path:
    state = {k: v for k, v in Small().state_dict().items() if not k.endswith("tracked")}
    state |= changes  # type: ignore[arg-type]
    torch.save({k.replace("__", "."): v for k, v in state.items() if v is not None}, folder / "w.pth")
    return folder / "w.pth"


def load(path: Path) -> Small:
    return load_network(Small, path, "small.pth", ignored=("classifier.",))


def test_good_weights_arrive_for_inference(tmp_path: Path) -> None:
    weight = torch.arange(6, dtype=torch.float16).reshape(3, 2)
    network = load(saved(tmp_path, **{"layer.weight": weight, "classifier.0": torch.zeros(7)}))
    assert torch.equal(network.layer.weight, weight.float())
    assert not network.training
    assert not network.layer.weight.requires_grad


def test_weights_are_taken_over_and_not_copied() -> None:
    state = {key: value for key, value in Small().state_dict().items()}
    network = fill_network(Small, state, "memory", "small.pth")
    assert network.layer.weight.data_ptr() == state["layer.weight"].data_ptr()


def test_a_class_is_read_where_it_is_allowed(tmp_path: Path) -> None:
    torch.save({"args": Namespace(lr=0.1)}, tmp_path / "w.pth")
    assert read_torch(tmp_path / "w.pth", "small.pth", [Namespace])["args"].lr == 0.1
    with pytest.raises(InputError, match=r"it asks for argparse\.Namespace, which is not executed"):
        read_torch(tmp_path / "w.pth", "small.pth")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"layer.bias": None}, "1 missing: layer.bias"),
        ({"head.bias": torch.zeros(1)}, "1 unknown: head.bias"),
        (
            {"layer.weight": torch.zeros(3, 3)},
            r"1 of a wrong shape: layer.weight is \(3, 3\), not \(3, 2\)",
        ),
        ({"layer.weight": 3}, "holds no table of tensors"),
    ],
)
def test_other_weights_are_named(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message + r".*expected small.pth"):
        load(saved(tmp_path, **changes))


def test_files_that_hold_no_weights(tmp_path: Path) -> None:
    path = tmp_path / "w.pth"
    with pytest.raises(InputError, match=r"does not exist.*expected small.pth"):
        load(path)
    for content in (b"", b"not weights at all", saved(tmp_path).read_bytes()[:400]):
        path.write_bytes(content)
        with pytest.raises(InputError, match="cannot be read as plain weights"):
            load(path)


def test_nothing_in_a_file_is_executed(tmp_path: Path) -> None:
    torch.save(Small(), tmp_path / "w.pth")
    with pytest.raises(InputError, match="a whole pickled object"):
        load(tmp_path / "w.pth")


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_torchscript_archive_is_told_apart(tmp_path: Path) -> None:
    torch.jit.save(torch.jit.script(nn.Linear(2, 3)), str(tmp_path / "w.pth"))
    with pytest.raises(InputError, match="a TorchScript archive"):
        load(tmp_path / "w.pth")


class Twice(nn.Module):
    def __init__(self) -> None:
        super().__init__()
        self.layer = nn.Linear(2, 3)
        self.same = self.layer
        self.index = torch.arange(4)  # no buffer of the state: meta tensors would lose it


def test_a_network_that_is_built_already_is_filled_and_shared_tensors_need_one_name() -> None:
    state = {"layer.weight": torch.ones(3, 2), "same.bias": torch.zeros(3)}
    network = fill(Twice(), state, "memory", "twice.pth")
    assert network.layer is network.same
    assert torch.equal(network.same.weight, torch.ones(3, 2))
    assert network.index.tolist() == [0, 1, 2, 3]
    with pytest.raises(InputError, match=r"memory does not fit \(2 missing: layer.bias, same.bias\)"):
        fill(Twice(), {"layer.weight": torch.ones(3, 2)}, "memory", "twice.pth")


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        load(path)
    return str(caught.value).replace(str(path), "FILE")


DAMAGED = (
    "FILE cannot be read as plain weights (damaged, a TorchScript archive or a whole pickled object{}); "
    "expected small.pth"
)


def test_a_compressed_archive_is_refused_before_it_is_unpacked(tmp_path: Path) -> None:
    whole = saved(tmp_path)
    with zipfile.ZipFile(whole) as old, zipfile.ZipFile(tmp_path / "z.pth", "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            new.writestr(name, old.read(name) if not name.endswith("data/0") else bytes(10_000_000))
    assert refusal(tmp_path / "z.pth") == DAMAGED.format("; it is compressed, as torch.save never does")


def test_an_archive_of_countless_parts_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(weights, "HEADER_BYTES", 100)
    assert refusal(saved(tmp_path)) == DAMAGED.format("; it holds more parts than weights have")


def test_an_archive_of_endless_values_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(weights, "_PICKLE_BYTES", 100)
    assert refusal(saved(tmp_path)) == DAMAGED.format("; it holds more plain values than weights have")


def test_a_pipe_is_no_weights(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "w.pth")
    assert refusal(tmp_path / "w.pth") == "FILE does not exist or is no file; expected small.pth"
    os.mkfifo(tmp_path / "w.safetensors")
    assert refusal(tmp_path / "w.safetensors") == (
        "FILE is missing or damaged (the file cannot be read: it is not a regular file); expected small.pth"
    )


@pytest.mark.parametrize("header", [0, 2**40, 2**63])
def test_a_header_longer_than_the_file_is_refused(tmp_path: Path, header: int) -> None:
    (tmp_path / "w.safetensors").write_bytes(header.to_bytes(8, "little") + b"{}")
    assert refusal(tmp_path / "w.safetensors") == (
        f"FILE is missing or damaged (it states a header of {header} bytes and has 10); expected small.pth"
    )


@pytest.mark.parametrize(
    ("weight", "said"),
    [
        (torch.zeros(1).expand(3000, 2000), "claims the shape (3000, 2000), more than the file holds"),
        (torch.zeros(3, 2).to_sparse(), "is no plain tensor"),
        (torch.zeros(3, 2, device="meta"), "is no plain tensor"),
        (torch.zeros(3, 2, dtype=torch.int32), "holds int32, not float32"),
        (torch.zeros(3, 2, dtype=torch.complex64), "holds complex64, not float32"),
    ],
)
def test_tensors_that_are_none_are_named(tmp_path: Path, weight: torch.Tensor, said: str) -> None:
    path = saved(tmp_path, **{"layer.weight": weight})
    assert refusal(path) == f"FILE: layer.weight {said}; expected small.pth"


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), float("-inf")])
def test_weights_that_are_not_finite_are_refused(tmp_path: Path, bad: float) -> None:
    weight = torch.zeros(3, 2, dtype=torch.bfloat16)
    weight[2, 1] = bad
    path = saved(tmp_path, **{"layer.weight": weight})
    assert refusal(path) == "FILE: layer.weight holds numbers that are not finite; copy the file again"


def test_a_network_too_large_for_any_memory_is_refused() -> None:
    with pytest.raises(InputError, match=r"memory: no network is of these sizes \(.*\); expected small\.pth"):
        fill_network(lambda: nn.Linear(2**40, 2**40), {}, "memory", "small.pth")


def test_sizes_of_networks_are_bounded() -> None:
    check_sizes({"a": [1024, {"num_layers": 24}], "eps": 1e30, "on": True, "none": None}, "config.json")
    for values, said in (
        ({"a": {"width": 10_000_000}}, "config.json: width is 10000000; expected at most 65536"),
        ({"layers_per_block": [2, 1001]}, "config.json: layers_per_block is 1001; expected at most 1000"),
        ({"depth": -2000}, "config.json: depth is -2000; expected at most 1000"),
    ):
        with pytest.raises(InputError) as caught:
            check_sizes(values, "config.json")
        assert str(caught.value) == said
