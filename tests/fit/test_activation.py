"""Activations of both parts at once against plain torch."""

import torch

from dreamdrive.fit.activation import Activated, activate
from dreamdrive.fit.parameters import LearningRates, Parameters
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.splat import set_threads, threads

LEAVES = ("offsets", "quaternions", "log_scales", "logit_opacities", "sh")
MOVED = ("means", "quaternions", "log_scales", "logit_opacities", "sh")


def some_gaussians(count: int, seed: int) -> Gaussians:
    generator = torch.Generator().manual_seed(seed)

    def normal(*shape: int) -> torch.Tensor:
        return torch.randn(count, *shape, generator=generator)

    return Gaussians(
        means=normal(3),
        quaternions=normal(4),
        log_scales=3 * normal(3),
        logit_opacities=8 * normal(),
        sh=normal(4, 3),
        source_frame=torch.zeros(count, dtype=torch.int64),
    )


def parameters(count: int = 2500) -> Parameters:
    start = Parameters(some_gaussians(count, 1), torch.rand(count) + 0.1, LearningRates())
    with torch.no_grad():
        start.offsets.normal_(generator=torch.Generator().manual_seed(2))
    return start


def moved(count: int = 701) -> Gaussians:
    tensors = some_gaussians(count, 3).tensors()
    return Gaussians(**{k: v.requires_grad_() if k in MOVED else v for k, v in tensors.items()})


def plain(*parts: Gaussians) -> Activated:
    whole = Gaussians.concatenate(*parts)
    return Activated(
        whole.means, whole.quaternions, whole.log_scales.exp(), whole.logit_opacities.sigmoid(), whole.sh
    )


def pull(out: Activated) -> torch.Tensor:
    generator = torch.Generator().manual_seed(4)
    return sum((v * torch.randn(v.shape, generator=generator)).sum() for v in vars(out).values())


def gradients(out: Activated, static: Parameters | None, dynamic: Gaussians | None) -> list[torch.Tensor]:
    leaves = [] if static is None else [getattr(static, name) for name in LEAVES]
    leaves += [] if dynamic is None else [getattr(dynamic, name) for name in MOVED]
    return list(torch.autograd.grad(pull(out), leaves))


def test_values_and_gradients_agree_with_plain_torch() -> None:
    static, dynamic = parameters(), moved()
    for s, d in ((static, dynamic), (static, None), (None, dynamic)):
        parts = [part for part in (None if s is None else s.gaussians(), d) if part is not None]
        ours, expected = activate(s, d), plain(*parts)
        for name, value in vars(expected).items():
            torch.testing.assert_close(getattr(ours, name), value, rtol=1e-6, atol=2e-7)
        for a, b in zip(gradients(ours, s, d), gradients(expected, s, d), strict=True):
            torch.testing.assert_close(a, b, rtol=1e-5, atol=1e-12)


def test_extremes_are_those_of_torch_and_nan_stays() -> None:
    one = some_gaussians(7, 0).tensors()
    logits = torch.tensor([-200.0, -80, -20, 0, 20, 90, float("nan")])
    scales = torch.tensor([-60.0, -20, 0, 20, 85, 100, float("nan")])[:, None].expand(7, 3)
    out = activate(None, Gaussians(**one | {"logit_opacities": logits, "log_scales": scales.contiguous()}))
    torch.testing.assert_close(out.opacities, logits.sigmoid(), rtol=1e-6, atol=1e-37, equal_nan=True)
    torch.testing.assert_close(out.scales, scales.exp(), rtol=1e-6, atol=0, equal_nan=True)


def test_a_part_may_be_empty() -> None:
    static, nobody = parameters(5), moved(0)
    assert len(activate(static, nobody).means) == 5
    assert gradients(activate(static, nobody), static, nobody)[-1].shape == (0, 4, 3)
    assert len(activate(None, nobody).means) == 0


def test_thread_count_changes_no_bit() -> None:
    before, results = threads(), []
    static, dynamic = parameters(), moved()
    try:
        for count in (1, 2, 3):
            set_threads(count)
            out = activate(static, dynamic)
            results.append([*vars(out).values(), *gradients(out, static, dynamic)])
    finally:
        set_threads(before)
    for other in results[1:]:
        assert all(torch.equal(a, b) for a, b in zip(results[0], other, strict=True))
