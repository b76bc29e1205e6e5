"""The compiled networks refuse what no caller should give them."""

import pytest
import torch

from dreamdrive import _native

DEEPEST = 2**31 - 1
LAYERS = [torch.zeros(4, 3), torch.zeros(4), torch.zeros(2, 4), torch.zeros(2)]


@pytest.mark.parametrize("depth", [-1, 0, 2, 2**30, DEEPEST])
@pytest.mark.parametrize("tensors", [[], LAYERS], ids=["none", "one layer and a head"])
def test_a_depth_of_other_layers_than_there_are_is_refused(tensors: list[torch.Tensor], depth: int) -> None:
    with pytest.raises(ValueError, match="expected hidden layers, then heads"):
        _native.dense_network(tensors, depth)
    with pytest.raises(ValueError, match="expected hidden layers, then heads"):
        _native.encoded_network(tensors, depth, -1, torch.zeros(5, 3), torch.zeros(3), 1.0, 2, torch.zeros(1))


def test_weights_without_sides_are_refused() -> None:
    flat = [torch.tensor(0.0), torch.tensor(0.0), *LAYERS[2:]]
    with pytest.raises(ValueError, match="expected hidden layers, then heads"):
        _native.encoded_network(flat, 1, -1, torch.zeros(5, 3), torch.zeros(3), 1.0, 2, torch.zeros(1))


def test_layers_that_fit_are_taken() -> None:
    network = _native.dense_network(LAYERS, 1)
    out = torch.empty(6, 2)
    _native.dense_network_forward(network, torch.ones(6, 3), out)
    assert (out == 0).all()
