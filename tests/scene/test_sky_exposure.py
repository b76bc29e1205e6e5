"""Sky by direction alone, exposure by time, the scene that joins them."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation

from dreamdrive.fit.exposure import ExposureNetwork, recorded_picture
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.exposure import Exposure, transform_colour
from dreamdrive.scene.sky import Sky
from dreamdrive.splat import set_threads, threads
from dreamdrive_bench.splat import plain_step as plain


def camera(yaw_deg: float = 0.0, pitch_deg: float = 0.0, position: tuple[float, ...] = (0, 0, 0)) -> Camera:
    """Yaw to the right, pitch upwards."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("yx", [yaw_deg, pitch_deg], degrees=True).as_matrix()
    pose[:3, 3] = position
    return Camera(40.0, 40.0, 20.0, 15.0, 40, 30, pose)


def compass(height: int = 90, width: int = 360) -> Sky:
    """Red says azimuth / pi, green elevation / (pi / 2), over the whole upper half."""
    azimuth = (np.arange(width) + 0.5) / width * 2 - 1
    elevation = 1 - (np.arange(height) + 0.5) / height
    texture = np.stack([*np.meshgrid(azimuth, elevation), np.zeros((height, width))], -1)
    return Sky(torch.tensor(texture, dtype=torch.float32), (-np.pi, np.pi), (0.0, np.pi / 2))


@given(st.floats(-170, 170), st.floats(5, 80))
@settings(max_examples=40)
def test_every_pixel_gets_the_colour_of_its_direction(yaw_deg: float, pitch_deg: float) -> None:
    view = camera(yaw_deg, pitch_deg)
    rays = view.rays() @ view.world_from_camera[:3, :3].T
    azimuth = np.arctan2(rays[..., 0], rays[..., 2])
    elevation = np.arctan2(-rays[..., 1], np.hypot(rays[..., 0], rays[..., 2]))
    inside = (np.abs(azimuth) < np.pi * 0.99) & (elevation > 0.02) & (elevation < np.pi / 2 - 0.02)
    seen = compass().colour(view).numpy()
    np.testing.assert_allclose(seen[inside, 0], azimuth[inside] / np.pi, atol=2e-3)
    np.testing.assert_allclose(seen[inside, 1], elevation[inside] / (np.pi / 2), atol=2e-3)


def test_position_does_not_matter() -> None:
    assert torch.equal(compass().colour(camera(20, 30)), compass().colour(camera(20, 30, (5, -1, 9))))


def test_outside_the_edge_goes_on() -> None:
    sky = Sky(torch.tensor([[[0.1] * 3, [0.9] * 3]]), (-0.2, 0.2), (0.0, 0.5))
    assert sky.colour(camera(90))[:, 20].mean().item() == pytest.approx(0.9)
    assert sky.colour(camera(-90))[:, 20].mean().item() == pytest.approx(0.1)


def test_a_range_around_the_back_has_no_jump_inside() -> None:
    texture = torch.linspace(0, 1, 50)[None, :, None].expand(4, -1, 3).contiguous()
    sky = Sky(texture, (np.pi - 0.6, np.pi + 0.6), (-0.5, 0.5))
    row = sky.colour(camera(180))[15, :, 0]
    assert (row.diff() > 0).all()


def test_sky_gradients() -> None:
    texture = torch.rand(3, 4, 3, dtype=torch.float64, requires_grad=True)
    small = Camera(5.0, 5.0, 3.0, 2.0, 6, 4)

    def look(values: torch.Tensor) -> torch.Tensor:
        return Sky(values, (-0.7, 0.7), (-0.4, 0.5)).colour(small)

    assert torch.autograd.gradcheck(look, [texture])


def test_exposure_is_linear_between_frames_and_constant_outside() -> None:
    transforms = torch.stack([torch.eye(3, 4), 3 * torch.eye(3, 4), torch.zeros(3, 4)])
    exposure = Exposure(transforms, np.array([0.0, 1.0, 4.0]))
    for t_s, gain in ((-1.0, 1), (0.0, 1), (0.25, 1.5), (1.0, 3), (2.5, 1.5), (4.0, 0), (9.0, 0)):
        torch.testing.assert_close(exposure.at(t_s), gain * torch.eye(3, 4))
    image = torch.rand(2, 2, 3)
    torch.testing.assert_close(exposure.apply(image, 0.5), 2 * image)


def test_exposure_network_starts_at_the_identity_and_learns_each_frame_apart() -> None:
    network = ExposureNetwork(3, seed=1)
    torch.testing.assert_close(network(2), torch.eye(3, 4))
    gains = (0.8, 1.0, 1.3)
    optimiser = torch.optim.Adam(network.parameters(), lr=0.02)
    for _ in range(150):
        loss = sum(((network(i) - gain * torch.eye(3, 4)) ** 2).sum() for i, gain in enumerate(gains))
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    frozen = network.freeze(np.array([0.0, 0.1, 0.2]), np.array([True, False, True]))
    torch.testing.assert_close(frozen.transforms[0], 0.8 * torch.eye(3, 4), atol=0.03, rtol=0)
    # The middle frame was held out: its neighbours say what it looked like.
    torch.testing.assert_close(frozen.at(0.1), 1.05 * torch.eye(3, 4), atol=0.03, rtol=0)
    assert not frozen.transforms.requires_grad


def test_exposure_gradients() -> None:
    network = ExposureNetwork(2).double()
    torch.nn.init.normal_(network.output.weight, std=0.1)
    image = torch.rand(2, 3, 3, dtype=torch.float64, requires_grad=True)
    affine = network(1).detach().requires_grad_()
    assert torch.autograd.gradcheck(transform_colour, [image, affine])
    transform_colour(image, network(1)).sum().backward()
    assert network.embedding.grad is not None
    assert network.embedding.grad[1].abs().sum() > 0
    assert network.embedding.grad[0].abs().sum() == 0


def picture_with_gradients(function, dtype: torch.dtype) -> list[torch.Tensor]:
    generator = torch.Generator().manual_seed(2)
    shapes = ((90, 101, 3), (90, 101), (90, 101, 3), (3, 4), (90, 101, 3))
    colour, alpha, sky, affine, pull = (
        torch.rand(shape, generator=generator, dtype=torch.float64).to(dtype) for shape in shapes
    )
    learned = [value.requires_grad_() for value in (colour, alpha, affine)]
    picture = function(colour, alpha, sky, affine)
    return [picture.detach(), *torch.autograd.grad((picture * pull).sum(), learned)]


def test_a_recorded_picture_is_the_transform_of_colour_over_sky() -> None:
    ours = picture_with_gradients(recorded_picture, torch.float32)
    expected = picture_with_gradients(plain.over_sky, torch.float64)
    for value, wanted in zip(ours, expected, strict=True):
        torch.testing.assert_close(value.double(), wanted, rtol=1e-5, atol=1e-5)


def test_thread_count_changes_no_bit_of_a_recorded_picture() -> None:
    before, results = threads(), []
    try:
        for count in (1, 2, 3):
            set_threads(count)
            results.append(picture_with_gradients(recorded_picture, torch.float32))
    finally:
        set_threads(before)
    for other in results[1:]:
        assert all(torch.equal(a, b) for a, b in zip(results[0], other, strict=True))


def test_a_recorded_picture_has_no_gradient_for_the_sky() -> None:
    with pytest.raises(ValueError, match="sky"):
        recorded_picture(
            torch.zeros(2, 2, 3), torch.zeros(2, 2), torch.ones(2, 2, 3, requires_grad=True), torch.eye(3, 4)
        )


def test_wrong_values_are_refused() -> None:
    with pytest.raises(ValueError, match="grow"):
        Sky(torch.zeros(2, 2, 3), (0.5, -0.5), (0.0, 1.0))
    with pytest.raises(ValueError, match="increasing"):
        Exposure(torch.zeros(2, 3, 4), np.array([1.0, 0.0]))
    with pytest.raises(ValueError, match="2 times for 3 frames"):
        ExposureNetwork(3).freeze(np.array([0.0, 1.0]), np.array([True, True]))


def test_each_camera_of_a_rig_has_its_own_exposure() -> None:
    transforms = torch.zeros(4, 3, 4)
    transforms[:, 0, 3] = torch.tensor([0.0, 10.0, 1.0, 11.0])
    exposure = Exposure(transforms, np.array([0.0, 0.0, 1.0, 1.0]), np.array([0, 1, 0, 1]))
    assert exposure.at(0.5)[0, 3] == 0.5
    assert exposure.at(0.5, 1)[0, 3] == 10.5
    with pytest.raises(ValueError, match="strictly increasing"):
        Exposure(transforms, np.array([0.0, 0.0, 1.0, 1.0]), np.array([0, 0, 1, 1]))
