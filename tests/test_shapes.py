"""Annotations are executed: a wrong shape or type fails where it enters."""

import numpy as np
import pytest
import torch
from jaxtyping import Float, TypeCheckError, jaxtyped

from dreamdrive.run.report.held_out import likeness
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.trajectory import Trajectory
from tests import checked


def test_a_dataclass_refuses_a_wrong_shape() -> None:
    with pytest.raises(TypeCheckError, match="world_from_camera"):
        Camera(100.0, 100.0, 32.0, 20.0, 64, 40, np.eye(3))


def test_a_dataclass_refuses_shapes_that_disagree() -> None:
    n = 4
    with pytest.raises(TypeCheckError, match="logit_opacities"):
        Gaussians(
            means=torch.zeros(n, 3),
            quaternions=torch.zeros(n, 4),
            log_scales=torch.zeros(n, 3),
            logit_opacities=torch.zeros(n + 1),
            sh=torch.zeros(n, 1, 3),
            source_frame=torch.zeros(n, dtype=torch.int64),
        )


def test_a_function_refuses_shapes_that_disagree() -> None:
    with pytest.raises(TypeCheckError, match="mask"):
        likeness(np.zeros((4, 6, 3)), np.zeros((4, 6, 3), np.uint8), np.ones((4, 5), bool))


def test_a_function_refuses_a_wrong_dtype() -> None:
    with pytest.raises(TypeCheckError, match="frame"):
        likeness(np.zeros((4, 6, 3)), np.zeros((4, 6, 3), np.float32), np.ones((4, 6), bool))


def test_a_result_is_refused_whose_shape_disagrees_with_the_parameters() -> None:
    @jaxtyped(typechecker=checked)
    def without_last(values: Float[np.ndarray, " n"], *, count: int = 1) -> Float[np.ndarray, " n"]:
        return values[:-count]

    with pytest.raises(TypeCheckError, match="return value"):
        without_last(np.zeros(3), count=1)
    assert len(without_last(np.zeros(3), count=-3)) == 3


def test_good_shapes_pass() -> None:
    assert len(Trajectory(np.eye(4)[None].repeat(2, 0), np.arange(2.0))) == 2
