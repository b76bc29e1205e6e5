"""Frames and training steps a second on a GPU: our backend and step beside gsplat's own.

Both render colour, alpha and depth of the street scene with spherical harmonics of degree 3 from eight places
along the road, and take the training steps of ``gpu_training``. They run in turn, in blocks of ten
with the GPU idle before and after. Figures are medians over blocks; the ratio says how many times
faster ours is. Below them stand the difference of the first images and the first and last losses of both:
where these disagree the two did not do the same work, and the exit code is 1.

``--fit`` makes a scene of 24 frames of PandaSet on the CPU and on the GPU: seconds of both fits, and what
frames that were held out show of them.

``--all`` measures everything about a GPU in one call of ``--minutes``, a process for each part: networks of
published size with random weights, tests of the kernels, fits of a packed clip, the rows above, a generated
clip, a profile. Kernels are compiled meanwhile, with ``--core`` the core as well. What fails is noted, and
the rest goes on. ``--pack`` is the folder with the clip; where it does not exist it is made first, which
takes pycolmap and minutes of two cores. ``--pretend`` tries all of it without a GPU, everything tiny.
"""

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any

import torch
from torch import Tensor

from dreamdrive.names import DeviceName
from dreamdrive.scene.gaussians import SH_C0
from dreamdrive.splat import NEAR_M, load_gsplat, rasterize, why_unusable
from dreamdrive_bench.common.options import parser_of, size_of
from dreamdrive_bench.common.places import DATA
from dreamdrive_bench.common.report import as_json, write
from dreamdrive_bench.splat.gpu_training import gsplat_step, intrinsics, our_step, ssim_of_the_peer
from dreamdrive_bench.splat.streets import pinhole_of, street

BLOCK = 10
VIEWS = 8
STRIDE_M = 0.25
COEFFICIENTS = 16

IMAGES_DIFFER = 1e-3
"""Mean difference of colours from 0 to 1, a quarter of a grey level: both call the same kernels."""
FIRST_LOSSES_DIFFER, LAST_LOSSES_DIFFER = 0.02, 0.2
"""Shares of gsplat's loss. fused_ssim leaves the edge of the image out, which ours counts; over hundreds of
steps that and the order of sums grow."""


def scene(
    width: int, height: int, count: int, device: str
) -> tuple[dict[str, Tensor], dict[str, float], Tensor]:
    """Arguments of ``rasterize``: Gaussians of the street, pinhole, poses (V, 4, 4) along the road."""
    arrays, _ = street(width, height, count)
    values = {name: torch.from_numpy(array).to(device) for name, array in arrays.items() if array.ndim}
    generator = torch.Generator().manual_seed(1)
    sh = 0.05 * torch.randn(count, COEFFICIENTS, 3, generator=generator).to(device)
    sh[:, 0] = (values["colors"] - 0.5) / SH_C0
    gaussians = {
        "means": values["means"],
        "quaternions": values["quats"],
        "scales": values["scales"],
        "opacities": values["opacities"],
        "sh": sh,
    }
    poses = values["viewmat"].repeat(VIEWS, 1, 1)
    poses[:, 2, 3] -= STRIDE_M * torch.arange(VIEWS, device=device)
    return gaussians, pinhole_of(arrays), poses


def renderings(
    gsplat: ModuleType, gaussians: dict[str, Tensor], camera: dict[str, float], poses: Tensor
) -> tuple[Callable[[int], Tensor], Callable[[int], Tensor]]:
    """Our image of view i (modulo their number) and gsplat's, both with alpha and depth."""
    matrix = intrinsics(camera, poses.device)[None]

    @torch.no_grad()
    def ours(i: int) -> Tensor:
        pose = poses[i % len(poses)]
        return rasterize(**gaussians, camera_from_world=pose, **camera, backend="gsplat").colour

    @torch.no_grad()
    def theirs(i: int) -> Tensor:
        image, _, _ = gsplat.rasterization(
            gaussians["means"],
            gaussians["quaternions"],
            gaussians["scales"],
            gaussians["opacities"],
            gaussians["sh"],
            poses[i % len(poses)][None],
            matrix,
            camera["width_px"],
            camera["height_px"],
            near_plane=NEAR_M,
            sh_degree=3,
            packed=False,
            render_mode="RGB+D",
        )
        return image[0, ..., :3]

    return ours, theirs


def seconds_of_a_block(run: Callable[[int], Tensor], first: int) -> float:
    """Wall-clock of ``BLOCK`` runs, from an idle GPU to an idle GPU."""
    torch.cuda.synchronize()
    start = time.perf_counter()
    for i in range(first, first + BLOCK):
        run(i)
    torch.cuda.synchronize()
    return time.perf_counter() - start


def in_turn(
    ours: Callable[[int], Tensor], theirs: Callable[[int], Tensor], seconds: float
) -> dict[str, float]:
    """Both in alternating blocks until ``seconds`` are over, after two blocks each that do not count."""
    blocks: tuple[list[float], list[float]] = ([], [])
    begin, first = time.perf_counter(), 0
    while len(blocks[0]) < 5 or time.perf_counter() - begin < seconds:
        for run, taken in zip((ours, theirs), blocks, strict=True):
            taken.append(seconds_of_a_block(run, first))
        first += BLOCK
    return figures(blocks[0][2:], blocks[1][2:])


def figures(ours_s: list[float], theirs_s: list[float]) -> dict[str, float]:
    """Rates a second from the seconds of blocks, and how many times faster ours is."""
    return {
        "ours_per_s": BLOCK / median(ours_s),
        "best_ours_per_s": BLOCK / min(ours_s),
        "gsplat_per_s": BLOCK / median(theirs_s),
        "best_gsplat_per_s": BLOCK / min(theirs_s),
        "ratio": median(theirs_s) / median(ours_s),
    }


def measure(gsplat: ModuleType, size: tuple[int, int], count: int, seconds: float) -> dict[str, Any]:
    """One row of the result."""
    gaussians, camera, poses = scene(*size, count, "cuda")
    ours, theirs = renderings(gsplat, gaussians, camera, poses)
    targets = torch.stack([ours(i) for i in range(VIEWS)]).contiguous()
    difference = (ours(0) - theirs(0)).abs().mean().item()
    rendering = in_turn(ours, theirs, seconds)
    step = our_step(gaussians, camera, poses, targets)
    peer_step = gsplat_step(gsplat, gaussians, camera, poses, targets)
    losses = {"ours": [step(0).item()], "gsplat": [peer_step(0).item()]}
    training = in_turn(step, peer_step, seconds)
    losses["ours"].append(step(0).item())
    losses["gsplat"].append(peer_step(0).item())
    return {
        "width": size[0],
        "height": size[1],
        "gaussians": count,
        "rendering": rendering,
        "training": training,
        "mean_abs_difference": difference,
        "loss_first_and_last": losses,
    }


def disagreements(row: dict[str, Any]) -> list[str]:
    """By what the two did not do the same work; NaN is a disagreement."""
    ours, theirs = (row["loss_first_and_last"][name] for name in ("ours", "gsplat"))
    limits = {"first": FIRST_LOSSES_DIFFER, "last": LAST_LOSSES_DIFFER}
    found = [
        f"the {which} losses differ by more than {100 * limit:g} %"
        for (which, limit), a, b in zip(limits.items(), ours, theirs, strict=True)
        if not abs(a - b) <= limit * abs(b)
    ]
    if not row["mean_abs_difference"] <= IMAGES_DIFFER:
        found.insert(0, f"the images differ by more than {IMAGES_DIFFER:g}")
    return found


def print_row(row: dict[str, Any]) -> None:
    """What was measured, for people, and whether it may be compared."""
    for work, unit in (("rendering", "frames/s"), ("training", "steps/s")):
        f = row[work]
        print(
            f"{work:<10}{row['width']:>6}x{row['height']:<6}{row['gaussians']:>10,}"
            f"   ours {f['ours_per_s']:>8.1f}   gsplat {f['gsplat_per_s']:>8.1f} {unit:<9} x{f['ratio']:.2f}"
        )
    (first, last), (peer_first, peer_last) = (row["loss_first_and_last"][name] for name in ("ours", "gsplat"))
    print(
        f"          images differ by {row['mean_abs_difference']:.1e} in the mean; losses, first to last: "
        f"ours {first:.4f} to {last:.4f}, gsplat {peer_first:.4f} to {peer_last:.4f}"
    )
    for trouble in disagreements(row):
        print(f"          NOT THE SAME WORK: {trouble}")


def fitted(device: DeviceName) -> dict[str, Any]:
    """Seconds of static and joint fit of 24 frames of PandaSet, and the held-out frames in decibels."""
    from dreamdrive.generate import generate  # here: the rows need none of what it brings along
    from dreamdrive.options import QUALITIES
    from dreamdrive.scene.control import Control

    control = Control(
        DATA / "clips/pandaset_002/front_camera", frames="20:68:2", fps=10, size=(480, 270), hold_out=8
    )
    with TemporaryDirectory() as folder:
        made = generate(control, Path(folder) / "out", options=replace(QUALITIES["draft"], device=device))
    return {"device": device, "seconds": made.seconds["static"] + made.seconds["fit"], "psnr": made.psnr}


def options_of() -> argparse.Namespace:
    """The command line."""
    parser = parser_of(__doc__)
    parser.add_argument("--gaussians", nargs="+", type=int, default=[500_000, 2_000_000], metavar="N")
    parser.add_argument(
        "--sizes", nargs="+", type=size_of, default=[(960, 576), (1920, 1080)], metavar="WIDTHxHEIGHT"
    )
    parser.add_argument("--seconds", type=float, default=5.0, metavar="S", help="for each figure")
    parser.add_argument("--fit", action="store_true", help="a scene of PandaSet, on the CPU and the GPU")
    parser.add_argument("--all", action="store_true", help="everything, in one call")
    parser.add_argument("--only", nargs="+", default=[], metavar="PART", help="of --all, these parts alone")
    parser.add_argument("--pack", type=Path, metavar="FOLDER", help="the clip of --all; made if absent")
    parser.add_argument("--core", action="store_true", help="with --all, compile the core of this checkout")
    parser.add_argument("--minutes", type=float, default=8.0, metavar="M", help="that --all may take")
    parser.add_argument("--pretend", action="store_true", help="with --all, no GPU and everything tiny")
    return parser.parse_args()


def everything(options: argparse.Namespace) -> int:
    """``--all``, and the pack that it takes."""
    from dreamdrive_bench.gpu.recorded import make_pack
    from dreamdrive_bench.gpu.whole import run_all

    if options.pack and not options.pack.exists():
        make_pack(options.pack)
    if not options.all:
        return 0
    how = {"pretend": options.pretend, "core": options.core, "only": options.only}
    return run_all(options.json or Path("gpu.json"), options.pack, minutes=options.minutes, **how)


def main() -> int:
    """Measure all sizes with all numbers of Gaussians; 1 where the two did not do the same work."""
    options = options_of()
    if options.all or options.pack:
        return everything(options)
    trouble = why_unusable()
    if trouble is not None:
        sys.exit(f"gpu measures a GPU, and none can be used: {trouble}")
    gsplat = load_gsplat()
    source = ssim_of_the_peer()[0]
    if source != "fused_ssim":
        print(
            f"fused_ssim is not installed: gsplat's steps take SSIM in {source}, and the ratio flatters ours"
        )
    torch.backends.cudnn.allow_tf32 = False  # SSIM takes differences of squares
    rows = []
    for size in options.sizes:
        for count in options.gaussians:
            rows.append(measure(gsplat, size, count, options.seconds))
            print_row(rows[-1])
    fits = [fitted(device) for device in ("cpu", "cuda")] if options.fit else []
    for fit in fits:
        print(f"fit on {fit['device']:<6}{fit['seconds']:>8.1f} s   held-out frames {fit['psnr']:.2f} dB")
    if options.json:
        machine = {
            "gpu": torch.cuda.get_device_name(),
            "torch": torch.__version__,
            "cuda": torch.version.cuda,
            "gsplat": gsplat.__version__,
            "ssim_of_the_peer": source,
        }
        write(options.json, as_json({"machine": machine, "rows": rows, "fits": fits}))
    return 1 if any(map(disagreements, rows)) else 0
