"""Numbers of other shapes in the format of the golden ones.

``python -m tests.golden.make TO --seed 1`` writes them.

They are made by the code that is tested, so they prove nothing of it. They prove that the tests take all
sizes from the files: each seed has other heads, widths, depths, clips, frames, steps, cameras and pictures.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from dreamdrive.evaluate.clips.frechet import frechet_distance, polynomial_mmd
from dreamdrive.evaluate.networks.i3d import i3d_features, load_i3d, prepare
from dreamdrive.evaluate.networks.inception import inception_features, load_inception
from dreamdrive.evaluate.networks.lpips import load_lpips
from dreamdrive.evaluate.networks.resize import resize
from dreamdrive.vision.pixels import psnr, ssim
from tests.evaluate.networks.seeded import seeded_state
from tests.evaluate.networks.test_lpips import files
from tests.golden import make_dust3r, make_magicdrive, make_vista, reading
from tests.golden.cut import write
from tests.vision.test_pixels import VARIANTS

_KEYS = Path(__file__).parent / "eval/perceptual.json"
"""Names and shapes of the weights of the published networks, which have no others."""


def make(to: Path, seed: int) -> None:
    """Write a set."""
    reading.FOLDER = to
    rng = np.random.default_rng(seed)
    torch.manual_seed(seed)
    with torch.no_grad():
        _frechet(to, rng)
        _perceptual(to, rng)
        make_magicdrive.make(to, rng)
        make_vista.make(to, rng)
    make_dust3r.make(to, rng)


def _frechet(to: Path, rng: np.random.Generator) -> None:
    sets: dict[str, np.ndarray] = {}
    expected: dict[str, Any] = {}
    for case in range(3):
        d = int(rng.integers(1, 40))
        a, b = (rng.normal(k, 1 + k, (int(rng.integers(5, 60)), d)).astype(np.float32) for k in (0, 0.5))
        name, m = f"case_{case}", min(len(a), len(b))
        sets |= {f"{name}/a": a, f"{name}/b": b}
        a, b = a.astype(np.float64), b.astype(np.float64)
        sample, population = frechet_distance(a, b), frechet_distance(a, b, "population")
        expected[name] = {
            "reference symmetric eigh (unbiased)": sample,
            "reference symmetric eigh (biased)": population,
            "torchmetrics": "an error" if case == 0 else sample,
            "cd_fvd / stylegan_v metric_utils (biased cov)": population,
            "kid_torch_fidelity_first_m": polynomial_mmd(a[:m], b[:m]),
            "kvd_lvdm (deg 3, gamma 1/d, coef 1, all samples)": polynomial_mmd(a, b),
            "jedi_mmd_deg2_coef0_biased (x100 = JEDi)": polynomial_mmd(
                a, b, degree=2, offset=0, unbiased=False
            ),
        }
    write(to / "eval/frechet.npz", sets)
    write(to / "eval/frechet.json", expected)


def _perceptual(to: Path, rng: np.random.Generator) -> None:
    arrays: dict[str, Any] = {}
    table = {k: v for k, v in json.loads(_KEYS.read_text()).items() if not k.startswith("image_")}
    for index in range(2):
        a = torch.rand(3, *map(int, rng.integers(20, 60, 2)))
        b = (a + 0.1 * torch.randn_like(a)).clamp(0, 1) if index else a.clone()
        arrays |= {f"{index}/a": a, f"{index}/b": b}
        x, y = (each.permute(1, 2, 0).contiguous() for each in (a, b))
        found = {name: ssim(x, y, border) for border, name in VARIANTS.items()}  # type: ignore[arg-type]
        rounded = psnr(x, torch.round(y * 255) / 255)
        found |= {"psnr": psnr(x, y) if index else "inf", "psnr_after_8bit_rounding_of_second": rounded}
        table[f"image_{index}"] = found
    arrays |= {f"lpips/{k}": torch.rand(1, 3, *_sides(rng, 64, 100)[:2]) for k in "a"}
    arrays["lpips/b"] = torch.rand_like(arrays["lpips/a"])
    for kind in ("alex", "vgg"):
        distance = load_lpips(*files(table[f"lpips_{kind}"], kind, _scratch(to)))
        a, b = arrays["lpips/a"], arrays["lpips/b"]
        table[f"lpips_{kind}"]["normalize_true"] = float(distance(2 * a - 1, 2 * b - 1))
        table[f"lpips_{kind}"]["normalize_false_01_input"] = float(distance(a, b))
    arrays |= _inception(table["inception"], to, rng) | _i3d(table["i3d"], to, rng)
    write(to / "eval/perceptual.npz", {k: np.asarray(v) for k, v in arrays.items()})
    write(to / "eval/perceptual.json", table)


def _sides(rng: np.random.Generator, least: int, most: int) -> list[int]:
    return rng.integers(least, most, 2).tolist()


def _scratch(to: Path) -> Path:
    folder = to.with_name(to.name + "_weights")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _seeded(settings: dict[str, Any], to: Path) -> Path:
    file = _scratch(to) / "weights.pt"
    torch.save(seeded_state(settings["keys"], settings["seed"]), file)
    return file


def _inception(settings: dict[str, Any], to: Path, rng: np.random.Generator) -> dict[str, Tensor]:
    x = torch.randint(256, (3, 3, *_sides(rng, 40, 160)), dtype=torch.uint8)
    frames = x.permute(0, 2, 3, 1).contiguous()
    network = load_inception(_seeded(settings, to))
    means: dict[str, Tensor] = {}
    for name, consumer in (("64", "Conv2d_3b_1x1"), ("192", "Mixed_5b"), ("768", "Mixed_7a")):

        def keep(module: object, inputs: tuple[Tensor], name: str = name) -> None:
            means[name] = inputs[0].mean(dim=(2, 3))

        network.get_submodule(consumer).register_forward_pre_hook(keep)
    means["2048"] = inception_features(network, frames)
    weights = seeded_state(settings["keys"], settings["seed"])["fc.weight"]
    means["logits_unbiased"] = means["2048"] @ weights.T
    clean = resize(frames[:1], 299, 299, "clean")[0].permute(1, 2, 0)
    return {
        "inception/x": x,
        **{f"inception/{name}": value for name, value in means.items()},
        "inception/resized_sub": resize(frames, 299, 299, "tf1")[:, :, ::13, ::13],
        "inception/resized_pytorch_sub": resize(frames, 299, 299, "torch")[:, :, ::13, ::13],
        "resize/clean_pil_bicubic_sub": clean[::13, ::13],
    }


def _i3d(settings: dict[str, Any], to: Path, rng: np.random.Generator) -> dict[str, Tensor]:
    count = int(rng.integers(9, 12))
    video = torch.randint(256, (count, *_sides(rng, 30, 60), 3), dtype=torch.uint8)
    longer = torch.cat([video, video])[: count + 3]
    network = load_i3d(_seeded(settings, to))
    logits = {f"i3d/logits{len(v)}": i3d_features(network, v)[None] for v in (video, longer)}
    return {"i3d/video": video, "i3d/input_sub": prepare(video)[:, :, ::3, ::16, ::16], **logits}


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("to", type=Path, help="folder for the set")
    parser.add_argument("--seed", type=int, default=0, help="of the shapes and of the numbers")
    given = parser.parse_args()
    make(given.to, given.seed)


if __name__ == "__main__":
    main()
