import torch
from torch.nn import functional

from dreamdrive.tasks.perception.network.decoder import BevDecoder, BevDecoderBlock, Bottleneck


def test_each_block_doubles() -> None:
    decoder = BevDecoder(12, (8, 8, 4)).eval()
    assert decoder(torch.rand(2, 12, 13, 7)).shape == (2, 4, 104, 56)


def test_what_the_encoder_said_is_added_at_each_size() -> None:
    block = BevDecoderBlock(4, 6, 8).eval()
    for each in block.conv.parameters():
        torch.nn.init.zeros_(each)
    encoded = torch.randn(1, 8, 3, 3)
    wanted = functional.relu(block.up(encoded)).repeat_interleave(4, 2).repeat_interleave(4, 3)
    torch.testing.assert_close(block(torch.rand(1, 4, 6, 6), encoded), wanted)


def test_a_bottleneck_keeps_its_shape() -> None:
    assert Bottleneck(8)(torch.rand(2, 8, 5, 6)).shape == (2, 8, 5, 6)
