"""A clip becomes a scene on another device: what comes back to the CPU, and when."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from dreamdrive.build import build_scene
from dreamdrive.compute import device as devices
from dreamdrive.options import QUALITIES, Options
from dreamdrive.progress import Work
from dreamdrive.street_network import load_knowledge
from tests.fit.pretended import DEVICE, copies_to_the_cpu, pretending, splat_there
from tests.streets import small_street, street_clip

SIZE, FRAMES, SEEN = (48, 32), 8, 6
OF_A_LOOK = 7  # maps of the frames that are seen at once
OF_THE_STATIC_FIT = 8  # what a Gaussian is, and the exposure
OF_A_MOVING_GAUSSIAN = 2  # its life and how it goes, of a per-frame street


class Counted:
    """Computes each stage, and keeps what it brought back."""

    def __init__(self, seen: list[torch.Size]) -> None:
        self.seen, self.by_stage = seen, dict[str, list[tuple[int, ...]]]()

    def __call__(self, name: str, key: object, compute: Callable[[Work], Any], **how: Any) -> Any:
        before = len(self.seen)
        made = compute(Work())
        self.by_stage[name] = [tuple(shape) for shape in self.seen[before:]]
        return made


def options(steps: int, device: str) -> Options:
    draft = QUALITIES["draft"]
    return replace(
        draft,
        device=device,
        static=replace(draft.static, steps=steps),
        fit=replace(draft.fit, steps=steps),
        score=replace(draft.score, steps=steps),
        trial=replace(draft.trial, visits=0.5),
    )


def brought_back(monkeypatch: pytest.MonkeyPatch, steps: int) -> dict[str, list[tuple[int, ...]]]:
    load_knowledge()  # read here: no file is read where tensors are pretended
    street = small_street(size=SIZE, frames=FRAMES)
    clip = street_clip(street, hold_out=4)
    poses = np.array([camera.world_from_camera for camera in street.cameras])
    clip = replace(clip, known=replace(clip.known, world_from_camera=poses, metric=True))
    assert (~clip.held_out).sum() == SEEN
    with monkeypatch.context() as patch:
        splat_there(patch)
        counted = Counted(copies_to_the_cpu(patch))
        patch.setattr(devices, "_chosen", DEVICE)
        with pretending() as device:
            build_scene(clip, options(steps, str(device)), run=counted)
    return counted.by_stage


@pytest.mark.slow
def test_nothing_comes_back_for_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """What comes back is what a stage hands on, as much after many steps as after few."""
    few, more = (brought_back(monkeypatch, steps) for steps in (2, 4))
    assert few == more
    picture = SIZE[::-1]
    counts = {name: len(shapes) for name, shapes in few.items()}
    trials = [
        OF_THE_STATIC_FIT,
        1,
    ] * 2  # of depth from the street network and from stereo, and their pictures
    assert counts == {
        "look": OF_A_LOOK,
        "geometry": 1 + sum(trials),
        "initialise": 0,
        "static": OF_THE_STATIC_FIT,
        "score": 2,
        "group": 0,
        "fit": OF_THE_STATIC_FIT + OF_A_MOVING_GAUSSIAN + FRAMES,
    }
    assert few["geometry"][0] == (SEEN, 3, *picture)  # the sweep of all frames
    assert few["score"][0] == (SEEN, *picture)  # all error maps
    assert few["fit"][-FRAMES:] == [(*picture, 6)] * FRAMES  # the views that the residual is taken of
