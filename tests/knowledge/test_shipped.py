"""The network by name and by file."""

from pathlib import Path

import numpy as np
import pytest
import torch

from dreamdrive.errors import InputError
from dreamdrive.knowledge import LookOptions, load_knowledge, look, shipped
from dreamdrive.knowledge.network import StreetNetwork
from dreamdrive.knowledge.weights import Training, write_network


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    """Weights that nothing was learned for."""
    torch.manual_seed(0)
    path = tmp_path / "random.safetensors"
    write_network(StreetNetwork(), Training(0, 0, "none", {}, {}, "none"), path)
    return path


def test_a_file_of_weights_sees(weights: Path) -> None:
    frames = np.random.default_rng(0).integers(0, 255, (3, 90, 160, 3), np.uint8)
    options = LookOptions(width_px=160, features=True)
    seen = look(frames, weights, options=options)
    assert seen.depth.shape == (3, 90, 160)
    assert seen.features is not None
    assert seen.features.shape[2:] == (11, 20)
    again = look(frames[1:], load_knowledge(weights), options=options)
    assert np.allclose(seen.depth[1:], again.depth, rtol=1e-4)
    assert np.isfinite(seen.depth).all()


def test_missing_weights_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shipped, "_FILE", tmp_path / "street.safetensors")
    with pytest.raises(InputError, match="this installation has no weights; give a file of weights"):
        load_knowledge()
    with pytest.raises(InputError, match="there is no such file; expected street, or a file of weights"):
        load_knowledge(tmp_path / "other.safetensors")
    (tmp_path / "text.safetensors").write_text("nothing")
    with pytest.raises(InputError, match="missing or damaged"):
        load_knowledge(tmp_path / "text.safetensors")
