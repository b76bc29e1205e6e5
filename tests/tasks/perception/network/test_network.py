"""Cross-View Transformers against the original, with a stub for a trunk; and what holds for any."""

from collections.abc import Callable

import pytest
import torch
from torch import Tensor, nn

from dreamdrive.errors import InputError
from dreamdrive.street_network import load_knowledge
from dreamdrive.tasks.perception import (
    QUICK,
    SMALL,
    BevGrid,
    BevPrediction,
    CrossViewTransformer,
    CvtOptions,
    ImageSize,
    StreetTrunk,
    load_street,
)
from dreamdrive.tasks.perception.network.cross_view import image_plane
from tests.golden.reading import Table, close, tensors, values
from tests.tasks.perception.streets import TINY, Stub, cameras, street, tiny_network

NUMBERS, TABLE = "eval/cvt_tiny.npz", "eval/cvt_tiny.json"
LIMIT = 1e-6
"""Of the largest value."""


def golden_network() -> CrossViewTransformer:
    said, state = values(TABLE), tensors(NUMBERS).under("sd/")
    bev = said["bev"]
    options = CvtOptions(
        image=ImageSize(*said["image"], 0),
        grid=BevGrid(bev["bev_height"], bev["bev_width"], bev["h_meters"], bev["w_meters"]),
        dim=said["dim"],
        heads=said["heads"],
        head_dim=said["dim_head"],
        bottlenecks=tuple(said["middle"]),
        decoder=tuple(said["blocks"]),
        head=said["dim_last"],
    )
    channels = tuple(state[f"encoder.backbone.{each}.weight"].shape[0] for each in "ab")
    network = CrossViewTransformer(options, Stub(channels))
    network.load_state_dict(state)
    return network.eval()


def predict(network: CrossViewTransformer, given: Table) -> BevPrediction:
    with torch.no_grad():
        return network(given["image"], given["intrinsics"], given["extrinsics"])


def test_golden_answers() -> None:
    given = tensors(NUMBERS)
    said = predict(golden_network(), given)
    assert said.vehicle is not None
    assert said.centre is not None
    assert said.road is None
    close(said.vehicle, given["bev"][:, 0], LIMIT)
    close(said.centre, given["center"][:, 0], LIMIT)


def test_golden_parts() -> None:
    given, network = tensors(NUMBERS), golden_network()
    found: dict[str, Tensor] = {}

    def keep(name: str) -> Callable[[nn.Module, tuple[Tensor, ...], Tensor], None]:
        def kept(module: nn.Module, inputs: tuple[Tensor, ...], out: Tensor) -> None:
            found[name] = out

        return kept

    for index in range(2):
        network.encoder.cross_views[index].register_forward_hook(keep(f"mid_cross_view_{index}"))
        network.encoder.layers[index].register_forward_hook(keep(f"mid_layer_{index}"))
    network.decoder.register_forward_hook(keep("mid_decoder"))
    predict(network, given)
    assert len(found) == 5
    for name, value in found.items():
        close(value, given[name], LIMIT, name)


def test_golden_places_and_pixels() -> None:
    given, network = tensors(NUMBERS), golden_network()
    close(network.encoder.bev_embedding.grid, given["bev_grid"][:2], LIMIT)
    image = network.options.image
    for index in range(2):
        wanted = given[f"image_plane_{index}"][0, 0]
        found = image_plane(*wanted.shape[1:], (image.height_px, image.width_px))
        close(found, wanted, LIMIT)


def test_golden_keys_and_shapes() -> None:
    state = CrossViewTransformer().state_dict()
    assert {key: list(value.shape) for key, value in state.items()} == values(
        "eval/cvt_official_state_dict.json"
    )


def test_the_published_size() -> None:
    assert sum(each.numel() for each in CrossViewTransformer().parameters()) == 1_080_194


@pytest.mark.parametrize("count", [1, 2, 6])
def test_any_number_of_cameras_in_any_order(count: int) -> None:
    network = tiny_network().eval()
    pictures = torch.rand(2, count, 3, 32, 64)
    intrinsics, extrinsics = cameras(2, count)
    order = torch.randperm(count)
    with torch.no_grad():
        one = network(pictures, intrinsics, extrinsics)
        other = network(pictures[:, order], intrinsics[:, order], extrinsics[:, order])
    for name in ("vehicle", "centre", "road"):
        assert getattr(one, name).shape == (2, 16, 16)
        torch.testing.assert_close(getattr(one, name), getattr(other, name), rtol=1e-4, atol=1e-5)


def test_bytes_are_the_same_pictures() -> None:
    network, batch = tiny_network().eval(), street(0)
    rest = batch.pixel_from_camera, batch.camera_from_ego
    with torch.no_grad():
        one, other = network(batch.pictures, *rest), network(batch.pictures.float() / 255, *rest)
    assert one.road is not None
    assert other.road is not None
    assert torch.equal(one.road, other.road)


def test_half_precision_is_near() -> None:
    network, batch = tiny_network().eval(), street(0)
    rest = batch.pixel_from_camera, batch.camera_from_ego
    with torch.no_grad():
        exact = network(batch.pictures, *rest)
        with torch.autocast("cpu", torch.bfloat16):
            near = network(batch.pictures, *rest)
    assert exact.vehicle is not None
    assert near.vehicle is not None
    assert near.vehicle.dtype == torch.float32
    assert float((near.vehicle - exact.vehicle).norm() / exact.vehicle.norm()) < 0.05


@pytest.mark.parametrize("options", [SMALL, QUICK])
def test_small_networks_have_both_classes(options: CvtOptions) -> None:
    network = CrossViewTransformer(options).eval()
    assert network.encoder.bev_embedding.learned_features.shape == (128, 13, 13)
    with torch.no_grad():
        said = network(torch.rand(1, 1, 3, 96, 208), *cameras(1, 1))
    assert said.vehicle is not None
    assert said.road is not None
    assert said.vehicle.shape == said.road.shape == (1, 104, 104)


def test_the_street_network_as_a_trunk() -> None:
    trunk = StreetTrunk()
    load_street(trunk)
    assert all(each.requires_grad for each in trunk.parameters())
    pictures = torch.rand(1, 3, 96, 208)
    with torch.no_grad():
        found = trunk.eval()((pictures - trunk.mean) / trunk.spread)
        _, fine, _, coarse, _ = load_knowledge().encoder(pictures)
    assert (fine.shape, coarse.shape) == ((1, 24, 24, 52), (1, 112, 6, 13))
    for one, other in zip(found, (fine, coarse), strict=True):
        close(one, other, 1e-4)


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(InputError, match="multiples of 8"):
        CvtOptions(grid=BevGrid(100, 100))
    with pytest.raises(InputError, match="vehicle, road or both"):
        CvtOptions(classes=())
    with pytest.raises(InputError, match="multiple of 4"):
        CvtOptions(dim=30)
    with pytest.raises(InputError, match="trunk_width"):
        CvtOptions(trunk="street", trunk_width=0.5)
    with pytest.raises(InputError, match="no cells"):
        BevGrid(0, 8)
    with pytest.raises(InputError, match="no size of a picture"):
        ImageSize(10, 10, -1)
    with pytest.raises(ValueError, match="a backbone with 0 maps"):
        CrossViewTransformer(TINY, nn.Identity())
    with pytest.raises(ValueError, match=r"pictures of \(8, 8\)"):
        tiny_network()(torch.rand(1, 1, 3, 8, 8), *cameras(1, 1))
