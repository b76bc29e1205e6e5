import torch

from dreamdrive.tasks.perception import BevGrid
from dreamdrive.tasks.perception.network.cross_view import (
    BevEmbedding,
    CrossAttention,
    CrossView,
    image_plane,
)
from tests.tasks.perception.streets import cameras


def plain(attention: CrossAttention, queries, keys, values, skip):
    """The same, one place and one head at a time."""
    heads, rows = attention._heads, []
    q, k, v = attention.to_q(queries), attention.to_k(keys), attention.to_v(values)
    width = q.shape[-1] // heads
    for b in range(len(q)):
        for place in range(q.shape[2]):
            parts = []
            for head in range(heads):
                cut = slice(head * width, (head + 1) * width)
                logits = torch.cat([k[b, n, :, cut] @ q[b, n, place, cut] for n in range(q.shape[1])])
                share = (logits / width**0.5).softmax(0)
                parts.append(share @ v[b, ..., cut].flatten(0, 1))
            rows.append(torch.cat(parts))
    gathered = torch.stack(rows).unflatten(0, (len(q), -1))
    x = attention.prenorm(attention.proj(gathered) + skip)
    return attention.postnorm(x + attention.mlp(x))


def test_attention_is_one_softmax_over_all_cameras() -> None:
    torch.manual_seed(0)
    attention = CrossAttention(8, 2, 3).double()
    given = [torch.randn(*shape, 8).double() for shape in ((2, 3, 4), (2, 3, 5), (2, 3, 5), (2, 4))]
    torch.testing.assert_close(attention(*given), plain(attention, *given))


def test_gradients() -> None:
    torch.manual_seed(0)
    attention = CrossAttention(8, 2, 3).double()
    given = [
        torch.randn(*shape, 8).double().requires_grad_()
        for shape in ((1, 2, 2), (1, 2, 3), (1, 2, 3), (1, 2))
    ]
    assert torch.autograd.gradcheck(attention, given)


def test_a_ray_to_a_place_on_the_ground_has_the_code_of_its_direction() -> None:
    """Moving the ego frame along moves cameras and places alike: rays of pixels keep their codes."""
    torch.manual_seed(0)
    view = CrossView(4, (32, 64), 16, 2, 8)
    view.cam_embed.weight.data.copy_(view.img_embed.weight.data)
    places = BevEmbedding(16, (4, 4), BevGrid(16, 16, 40.0, 40.0)).grid
    intrinsics, extrinsics = cameras(1, 2)
    inverses = torch.linalg.inv(intrinsics), torch.linalg.inv(extrinsics)
    moved = inverses[1].clone()
    moved[..., :3, 3] += torch.tensor([3.0, -2.0, 0.0])
    one, other = (view._codes(places, 3, 5, inverses[0], pose)[1] for pose in (inverses[1], moved))
    torch.testing.assert_close(one, other, rtol=1e-4, atol=1e-5)
    torch.testing.assert_close(one.norm(dim=-1), torch.ones(1, 2, 15))


def test_places_run_from_border_to_border() -> None:
    grid = BevEmbedding(4, (3, 5), BevGrid(24, 40, 60.0, 100.0)).grid
    assert grid[0, :, 0].tolist() == [30.0, 0.0, -30.0]
    assert grid[1, 0].tolist() == [50.0, 25.0, 0.0, -25.0, -50.0]


def test_pixels_run_from_border_to_border() -> None:
    pixels = image_plane(3, 2, (224, 480))
    assert pixels[0, 0].tolist() == [0.0, 480.0]
    assert pixels[1, :, 0].tolist() == [0.0, 112.0, 224.0]
    assert bool((pixels[2] == 1).all())
