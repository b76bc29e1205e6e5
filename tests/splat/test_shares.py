"""How much of a view each Gaussian makes."""

import torch

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.splat import render, shares

CAMERA = Camera(40.0, 40.0, 16.0, 12.0, 32, 24)


def test_shares_of_a_view_add_up_to_what_it_covers() -> None:
    gaussians = Gaussians(
        means=torch.tensor([[-0.5, 0.0, 4.0], [0.6, 0.1, 5.0]]),
        quaternions=torch.tensor([[1.0, 0, 0, 0]]).repeat(2, 1),
        log_scales=torch.full((2, 3), -1.5),
        logit_opacities=torch.tensor([2.0, 0.5]),
        sh=torch.zeros(2, 1, 3),
        source_frame=torch.zeros(2, dtype=torch.int64),
    )
    left = torch.zeros(24, 32)
    left[:, :16] = 1
    found = shares(gaussians, CAMERA, torch.stack([torch.ones(24, 32), left], dim=-1))
    alpha = render(gaussians, CAMERA).alpha
    torch.testing.assert_close(found.sum(0), torch.stack([alpha.sum(), (alpha * left).sum()]))
    assert found[0, 1] > 0.9 * found[0, 0]
    assert found[1, 1] < 0.1 * found[1, 0]
