"""The real package with random weights, where it is installed."""

from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import save_model
from torch import nn

from dreamdrive.geometry.backends.feedforward.da3 import INSTALL, load_da3
from dreamdrive.geometry.backends.feedforward.load import upstream
from dreamdrive.geometry.backends.feedforward.network import Views


@pytest.mark.filterwarnings("ignore")
def test_da3_small_goes_from_disk_to_poses_and_depth(tmp_path: Path) -> None:
    pytest.importorskip("depth_anything_3", reason="pip install --no-deps depth-anything-3==0.1.1")
    cfg = upstream("depth_anything_3.cfg", INSTALL)
    torch.manual_seed(0)
    made = cfg.create_object(cfg.load_config("depth_anything_3.configs.da3-small"))
    # As the hub's files are written: keys of the model inside, one name of each shared tensor.
    save_model(nn.ModuleDict({"model": made}), str(tmp_path / "model.safetensors"))
    (tmp_path / "config.json").write_text('{"model_name": "da3-small"}')
    network = load_da3(tmp_path)
    with torch.inference_mode():
        seen = network.predict(Views(torch.rand(3, 3, 70, 126)))
    assert network.unit is None
    assert seen.depth.shape == seen.confidence.shape == (3, 70, 126)
    assert (seen.depth > 0).all()
    assert seen.intrinsics[:, :2, 2] == pytest.approx(np.tile([63, 35], (3, 1)))
    turns = seen.world_from_camera[:, :3, :3]
    np.testing.assert_allclose(turns @ turns.swapaxes(1, 2), np.tile(np.eye(3), (3, 1, 1)), atol=1e-9)
