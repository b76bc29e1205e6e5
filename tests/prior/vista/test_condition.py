"""What goes beside the noise, against the public code."""

from math import pi

import pytest
import torch
from diffusers.models.embeddings import Timesteps

from dreamdrive.prior.vista.condition import NUMBERS, clip_pixels, embed_action, numbers_of
from dreamdrive.prior.vista.kinds import ACTION_COLUMNS, MOTION_BUCKET, VISTA
from dreamdrive.scene.control import Command, Goal, Steering, Waypoints
from tests.golden.reading import cases, close, tensors

KINDS = {name: [name] for name in NUMBERS} | {"steer": ["speed", "angle"], "free": [], "all": list(NUMBERS)}
LIMIT = 1e-5
"""Of the largest value: sines of numbers up to some tens, which float32 rounds to 4e-6."""
FILE = "vista/conditioning.safetensors"


@pytest.mark.parametrize("name", cases(FILE, r"(.+)\.c\.crossattn"))
def test_golden_columns_of_each_action(name: str) -> None:
    given = tensors(FILE)
    columns = embed_action({kind: given[f"in.{kind}"].flatten().tolist() for kind in KINDS[name]})
    image = given["in.cond_frames_without_noise"].flatten()
    close(torch.cat([image, columns]), given[f"{name}.c.crossattn"].flatten(), LIMIT)
    assert torch.equal(given[f"{name}.c.concat"], given["in.cond_frames"])


@pytest.mark.parametrize("name", cases(FILE, r"(.+\.u?c)\.vector"))
def test_golden_encoding_of_rate_motion_and_noise(name: str) -> None:
    given = tensors(FILE)
    ids = torch.cat([given[f"in.{number}"] for number in ("fps_id", "motion_bucket_id", "cond_aug")]).float()
    vector = given[f"{name}.vector"].flatten()
    width = len(vector) // len(ids)
    close(Timesteps(width, flip_sin_to_cos=True, downscale_freq_shift=0)(ids).flatten(), vector, LIMIT)


@pytest.mark.parametrize("name", cases(FILE, r"(.+\.uc)\.crossattn"))
def test_golden_conditions_of_the_other_branch_are_zeros(name: str) -> None:
    given = tensors(FILE)
    assert not given[f"{name}.crossattn"].any()
    assert not given[f"{name}.concat"].any()


def test_the_settings_are_those_of_the_public_script() -> None:
    assert (VISTA.rate_hz - 1, MOTION_BUCKET, VISTA.noise) == (9, 127, 0)


def test_golden_clip_sees_a_square() -> None:
    given = tensors("vista/clip_preprocess.safetensors")
    made = clip_pixels(given["image_fp16"].float())
    stride = int(given["note_stride"])
    close(made[..., ::stride, ::stride], given["clip_input"], LIMIT)


def test_clip_sees_a_square_of_small_pictures_too() -> None:
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
