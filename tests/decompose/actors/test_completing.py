"""A van that overtakes on the left: one flank is seen, until it is far ahead never its left half."""

import numpy as np
import pytest
import torch

from dreamdrive.decompose.actors.body import body_of
from dreamdrive.decompose.actors.completing import completed
from dreamdrive.decompose.actors.life_spans import ActorView
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import Gaussians

AHEAD, UP = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])
FLANK_M, LONG_M, TALL_M = -2.0, 4.4, 1.5  # its right flank is two metres left of the camera


def flank(long_m: float = LONG_M) -> np.ndarray:
    along, down = np.meshgrid(np.arange(0, long_m, 0.1), np.arange(0, TALL_M, 0.1))
    return np.stack([np.full(along.size, FLANK_M), down.ravel(), 4 + along.ravel()], axis=1)


def gaussians(places: np.ndarray) -> Gaussians:
    n = len(places)
    generator = torch.Generator().manual_seed(1)
    return Gaussians(
        means=torch.tensor(places, dtype=torch.float32),
        quaternions=torch.nn.functional.normalize(torch.randn(n, 4, generator=generator), dim=1),
        log_scales=torch.tensor([-3.0, -3.0, -5.0]).repeat(n, 1),
        logit_opacities=torch.zeros(n),
        sh=torch.rand(n, 4, 3, generator=generator),
        source_frame=torch.zeros(n, dtype=torch.int64),
    )


def views(places: np.ndarray, count: int = 6) -> list[ActorView]:
    """It overtakes; the camera sees what the picture holds of its flank, before a far street."""
    found: list[ActorView] = []
    for k in range(count):
        camera = Camera(150, 150, 160, 96, 320, 192, np.eye(4))
        moved = np.eye(4)
        moved[2, 3] = 0.2 * (k - count) - 2.4
        seen = camera.project(places + moved[:3, 3])
        seen = seen[camera.shows(seen)]
        depth_m = np.full((192, 320), 60.0, np.float32)
        found.append(ActorView(0.1 * k, camera, moved, seen, depth_m))
    return found


def added(places: np.ndarray, seen: list[ActorView], to: Gaussians | None = None) -> Gaussians | None:
    body = body_of(places, AHEAD, UP, seen, "vehicle", None)
    return completed(gaussians(places) if to is None else to, body, seen, 4.5)


def test_a_flank_becomes_a_body() -> None:
    places = flank()
    found = added(places, views(places))
    assert found is not None
    x, y, z = found.means.numpy().T
    assert np.quantile(x, 0.05) == pytest.approx(FLANK_M - 1.85, abs=0.1)
    assert x.max() < FLANK_M + 0.05
    far = x < FLANK_M - 1.8  # the far flank lies behind the near one
    assert np.ptp(z[far]) > 0.8 * LONG_M
    assert np.ptp(y[far]) > 0.6 * TALL_M
    rear = (z < 4.3) & (x < FLANK_M - 0.3) & (x > FLANK_M - 1.5)
    assert rear.sum() > 20
    assert (found.sh[:, 1:] == 0).all()


def test_mirrored_gaussians_are_mirrored_in_shape() -> None:
    places = flank()
    seen = gaussians(places)
    found = added(places, views(places), seen)
    assert found is not None
    mirror = torch.diag(torch.tensor([-1.0, 1.0, 1.0]))
    far = torch.nonzero(found.means[:, 0] < FLANK_M - 1.84).squeeze(1)[:20]
    assert len(far)
    for row in far.tolist():
        image = found.means[row] * torch.tensor([-1.0, 1, 1]) + torch.tensor([2 * FLANK_M - 1.85, 0, 0])
        twin = int((seen.means - image).norm(dim=1).argmin())
        expected = mirror @ covariance(seen, twin) @ mirror
        torch.testing.assert_close(covariance(found, row), expected, rtol=1e-3, atol=1e-7)


def covariance(of: Gaussians, row: int) -> torch.Tensor:
    w, x, y, z = torch.nn.functional.normalize(of.quaternions[row], dim=0).tolist()
    turn = torch.tensor(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return turn @ torch.diag((2 * of.log_scales[row]).exp()) @ turn.T


@pytest.mark.parametrize("why", ["short", "few frames", "whole"])
def test_what_is_no_half_of_a_vehicle_is_left_alone(why: str) -> None:
    places = flank(1.5 if why == "short" else LONG_M)
    seen = views(places, 3 if why == "few frames" else 6)
    if why == "whole":
        seen = [
            ActorView(g.time_s, g.camera, g.world_from_canonical, g.copies + np.array([60, 0, 0]), g.depth_m)
            for g in seen
        ]
    assert added(places, seen) is None


def test_nothing_is_put_where_a_frame_saw_the_street() -> None:
    places = flank()
    seen = views(places)
    watching = Camera(150, 150, 160, 96, 320, 192, np.eye(4))
    beside = np.eye(4)
    beside[0, 3] = 3.0  # seen from the left lane, there is nothing but street
    open_street = ActorView(1.0, watching, beside, np.zeros((0, 3)), np.full((192, 320), 60.0, np.float32))
    free, watched = (added(places, each) for each in (seen, [*seen, open_street]))
    assert free is not None
    assert watched is None or len(watched) < 0.7 * len(free)
