"""The street without its traffic is the same street."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from dreamdrive_bench import removed
from streetworld import make_street
from tests.scene.scenes import make_scene


def test_an_emptied_street_is_the_same_where_nothing_moved(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(removed, "FRAMES", 3)
    monkeypatch.setattr(removed, "SIZE", (160, 96))
    made = make_street(0, 3, removed.RATE_HZ, (160, 96))
    empty = removed.emptied(made)
    assert made.moving.any()
    assert not empty.moving.any()
    same = ~made.moving & (np.abs(empty.frames.astype(int) - made.frames).max(axis=-1) <= removed.SHADOW)
    assert same.mean() > 0.7
    assert all(
        (a.world_from_camera == b.world_from_camera).all()
        for a, b in zip(empty.cameras, made.cameras, strict=True)
    )


def test_change_counts_only_where_no_actor_was() -> None:
    scene = make_scene()
    covered = replace(scene, dynamic=replace(scene.dynamic, sh=scene.dynamic.sh - 1))
    assert removed.largest_change(scene, covered) < 1e-3
    nothing = scene.dynamic.select(torch.zeros(0, dtype=torch.int64))
    still = replace(scene, dynamic=nothing, deformation=None, actors=())
    assert removed.largest_change(still, still) == 0
    darker = replace(still, static=replace(still.static, sh=still.static.sh - 1))
    assert removed.largest_change(still, darker) > 1
