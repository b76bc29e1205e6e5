"""What goes beside the noise, against the public code."""

from math import pi

import pytest
import torch
from diffusers.models.embeddings import Timesteps
from tests.prior.vista.conftest import Golden

from dreamdrive.prior.vista.condition import NUMBERS, clip_pixels, embed_action, numbers_of
from dreamdrive.prior.vista.kinds import ACTION_COLUMNS, MOTION_BUCKET, VISTA
from dreamdrive.scene.action import Command, Goal, Steering, Waypoints

KINDS = {name: [name] for name in NUMBERS} | {"steer": ["speed", "angle"], "free": [], "all": list(NUMBERS)}


@pytest.mark.parametrize("name", KINDS)
def test_golden_columns_of_each_action(golden: Golden, name: str) -> None:
    given = golden.tensors("conditioning")
    columns = embed_action({kind: given[f"in.{kind}"].flatten().tolist() for kind in KINDS[name]})
    image = given["in.cond_frames_without_noise"].flatten()
    context = torch.cat([image, columns])
    torch.testing.assert_close(context, given[f"{name}.c.crossattn"].flatten(), atol=2e-6, rtol=0)


def test_the_golden_settings_are_ours(golden: Golden) -> None:
    given = golden.tensors("conditioning")
    ids = torch.tensor([VISTA.rate_hz - 1, MOTION_BUCKET, VISTA.noise])
    vector = Timesteps(256, flip_sin_to_cos=True, downscale_freq_shift=0)(ids).flatten()
    for branch in ("c", "uc"):
        torch.testing.assert_close(vector, given[f"free.{branch}.vector"][0], atol=1e-5, rtol=0)
    assert not given["all.uc.crossattn"].any()
    assert not given["all.uc.concat"].any()
    assert torch.equal(given["all.c.concat"], given["in.cond_frames"])


def test_golden_clip_sees_a_square(golden: Golden) -> None:
    given = golden.tensors("clip_preprocess")
    made = clip_pixels(given["image_fp16"].float())
    assert made.shape == (1, 3, 224, 224)
    stride = int(given["note_stride"])
    torch.testing.assert_close(made[..., ::stride, ::stride], given["clip_input"], atol=1e-6, rtol=0)
    assert clip_pixels(torch.zeros(1, 3, 64, 64)).shape == (1, 3, 224, 224)


def test_units_of_the_car() -> None:
    assert numbers_of(Command("right")) == {"command": [0]}
    assert numbers_of(Command("stop")) == {"command": [3]}
    points = numbers_of(Waypoints((0.0, -0.1, -0.2, -0.3), (4.0, 8.0, 12.0, 16.0)))["trajectory"]
    assert points == [0.0, 4.0, -0.1, 8.0, -0.2, 12.0, -0.3, 16.0]
    steer = numbers_of(Steering((10.0,) * 4, (0.0, pi / 2, pi, -pi)))
    assert steer["speed"] == [36.0] * 4
    assert steer["angle"] == pytest.approx([0, 90 / 780, 180 / 780, -180 / 780])
    assert numbers_of(Goal(0.5, 0.6)) == {"goal": [0.5, 0.6]}


def test_a_missing_kind_is_not_the_number_zero() -> None:
    assert not embed_action({}).any()
    zero = embed_action({"command": [0]})
    assert zero.shape == (ACTION_COLUMNS,)
    assert zero[:64].eq(1).all()
    assert not zero[128:].any()
