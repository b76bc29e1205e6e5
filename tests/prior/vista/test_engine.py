"""The networks at work, one at a time."""

import gc
import weakref
from pathlib import Path

import pytest
import torch

from dreamdrive.prior.vista.engine import Engine, RoundConditions
from dreamdrive.prior.vista.kinds import VISTA
from dreamdrive.prior.vista.memory import Job
from dreamdrive.prior.vista.stored import open_weights


def test_a_network_leaves_when_the_next_one_comes(vista_dir: Path) -> None:
    """At once, not when Python next looks for cycles: a GPU has no room for two."""
    engine = Engine(open_weights(vista_dir, VISTA), torch.device("cpu"))
    seen = RoundConditions(torch.zeros(16), torch.zeros(4, 8, 8), torch.zeros(2432))
    gc.collect()
    gc.disable()
    try:
        with torch.inference_mode():
            engine.predict(seen, torch.zeros(6, 4, 8, 8), 0.0, torch.tensor([1.0, 0, 0, 0, 0, 0]))
        held = [weakref.ref(engine.network("unet"))]
        engine.network("vae")
        assert held[0]() is None
        held = [weakref.ref(engine.network("vae")), weakref.ref(engine.network("image_encoder"))]
        assert held[0]() is None
        engine.free()
        assert held[1]() is None
    finally:
        gc.enable()


def test_what_a_run_will_take_is_told_before(vista_dir: Path, caplog: pytest.LogCaptureFixture) -> None:
    engine = Engine(open_weights(vista_dir, VISTA), torch.device("cpu"))
    engine.check_fit(Job((64, 64), 6, 6))
    assert [record.getMessage() for record in caplog.records] == [
        "Vista at 64x64 takes image encoder 0.0 GB, encoder 0.0 GB, UNet 0.0 GB, decoder 0.0 GB, "
        "decoded frames 0.0 GB, one after the other"
    ]
