"""Milliseconds of splatting, forward and forward + backward, on the common street scenes.

    python benchmarks/splat.py --scenes a b --json out.json [--threads N] [--repeat N]

A scene is t, a, b, c or an .npz file. Gradients go to means, quaternions, scales, opacities and colours (SH
degree 0). Times are medians; ``best`` is the smallest. The peer is the project's plain-torch reference on
1,000 Gaussians of the first scene at 160 x 96, run in the same process with as many threads. The image is
compared with the float64 program of the common bench when a C++ compiler is there.
"""

import argparse
import json
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import torch
from _street_scenes import bench_dir, load, write_bin
from torch import Tensor

from dreamdrive.scene.gaussians import SH_C0
from dreamdrive.splat import native_info, rasterize, set_threads


def arguments_of(scene: dict[str, np.ndarray]) -> tuple[dict[str, Tensor], dict[str, float]]:
    """Tensors and pinhole that ``rasterize`` takes."""
    values = {
        "means": scene["means"],
        "quaternions": scene["quats"],
        "scales": scene["scales"],
        "opacities": scene["opacities"],
        "sh": ((scene["colors"] - 0.5) / SH_C0)[:, None],
        "camera_from_world": scene["viewmat"],
    }
    names = {"fx_px": "fx", "fy_px": "fy", "cx_px": "cx", "cy_px": "cy", "width_px": "W", "height_px": "H"}
    tensors = {name: torch.from_numpy(np.array(value, np.float32)) for name, value in values.items()}
    return tensors, {ours: scene[theirs].item() for ours, theirs in names.items()}


def times_ms(run: Callable[[], object], repeat: int) -> list[float]:
    """Wall-clock of ``repeat`` runs after two that warm up, sorted."""
    taken = []
    for index in range(repeat + 2):
        start = time.perf_counter()
        run()
        if index >= 2:
            taken.append(1e3 * (time.perf_counter() - start))
    return sorted(taken)


def both_passes(
    tensors: dict[str, Tensor], camera: dict[str, float], upstream: Tensor, backend: str, repeat: int
) -> tuple[list[float], list[float]]:
    """Times of the forward pass without, and of both passes with gradients to all but the pose."""
    leaves = {k: v.clone().requires_grad_(k != "camera_from_world") for k, v in tensors.items()}
    wanted = [leaf for leaf in leaves.values() if leaf.requires_grad]

    def forward() -> None:
        rasterize(**tensors, **camera, backend=backend)

    def forward_backward() -> None:
        image = rasterize(**leaves, **camera, backend=backend).colour
        torch.autograd.grad(image, wanted, upstream)

    return times_ms(forward, repeat), times_ms(forward_backward, repeat)


@cache
def float64_program() -> Path | None:
    """The compiled reference program, or None without a compiler or its source."""
    compiler, folder = shutil.which("g++") or shutil.which("clang++"), bench_dir()
    if compiler is None or folder is None:
        return None
    program = Path(tempfile.mkdtemp(prefix="dreamdrive-bench-")) / "reference_f64"
    source = folder / "reference_f64.cpp"
    subprocess.run([compiler, "-O3", "-std=c++17", "-o", program, source], check=True)
    return program


def image_error(scene: dict[str, np.ndarray], image: np.ndarray) -> tuple[float, float] | None:
    """Largest and mean absolute difference of the image from the float64 program's."""
    program = float64_program()
    if program is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        write_bin(scene, Path(folder) / "scene.bin")
        subprocess.run([program, "scene.bin", "image.bin"], cwd=folder, check=True, capture_output=True)
        numbers = np.fromfile(Path(folder) / "image.bin", np.float32)[: image.size]
    difference = np.abs(numbers.reshape(image.shape) - image)
    return float(difference.max()), float(difference.mean())


def measure(name: str, scene: dict[str, np.ndarray], source: str, repeat: int) -> dict[str, object]:
    """One row of the result."""
    tensors, camera = arguments_of(scene)
    upstream = torch.from_numpy(np.array(scene["v_img"], np.float32))
    forward, both = both_passes(tensors, camera, upstream, "native", repeat)
    render = rasterize(**tensors, **camera)
    error = image_error(scene, render.colour.numpy())
    return {
        "name": name,
        "source": source,
        "width": camera["width_px"],
        "height": camera["height_px"],
        "gaussians": len(tensors["means"]),
        "visible": int(render.visible.sum()),
        "forward_ms": forward[len(forward) // 2],
        "forward_backward_ms": both[len(both) // 2],
        "best_forward_ms": forward[0],
        "best_forward_backward_ms": both[0],
        "max_abs_error": None if error is None else error[0],
        "mean_abs_error": None if error is None else error[1],
    }


def against_peer(scene: dict[str, np.ndarray]) -> dict[str, object]:
    """The compiled backend and plain torch on the same small piece of a scene."""
    tensors, camera = arguments_of(scene)
    scale = 160 / camera["width_px"]
    camera |= {k: camera[k] * scale for k in ("fx_px", "fy_px", "cx_px", "cy_px")}
    camera |= {"width_px": 160, "height_px": 96}
    keep = torch.arange(0, len(tensors["means"]), max(1, len(tensors["means"]) // 1000))[:1000]
    part = {k: v if k == "camera_from_world" else v[keep] for k, v in tensors.items()}
    upstream = torch.randn(96, 160, 3, generator=torch.Generator().manual_seed(0))
    ours = [t[len(t) // 2] for t in both_passes(part, camera, upstream, "native", 9)]
    theirs = [t[len(t) // 2] for t in both_passes(part, camera, upstream, "reference", 3)]
    return {
        "peer": "plain torch reference, 1,000 Gaussians, 160x96",
        "native_ms": ours,
        "peer_ms": theirs,
        "ratio": [peer / native for peer, native in zip(theirs, ours, strict=True)],
    }


def print_table(rows: list[dict[str, object]], peer: dict[str, object]) -> None:
    """What was measured, for people."""
    print(f"{'scene':<10}{'size':>10}{'Gaussians':>11}{'forward ms':>12}{'+ backward':>12}{'max error':>11}")
    for row in rows:
        size = f"{row['width']}x{row['height']}"
        error = "-" if row["max_abs_error"] is None else f"{row['max_abs_error']:.1e}"
        times = f"{row['forward_ms']:>12.2f}{row['forward_backward_ms']:>12.2f}"
        print(f"{row['name']:<10}{size:>10}{row['gaussians']:>11}{times}{error:>11}   {row['source']}")
    (forward, both), (peer_forward, peer_both) = peer["native_ms"], peer["peer_ms"]
    print(
        f"\n{peer['peer']}: {peer_forward:.1f} / {peer_both:.1f} ms, native {forward:.2f} / {both:.2f} ms: ",
        end="",
    )
    print("{:.0f}x / {:.0f}x faster".format(*peer["ratio"]))


def main() -> None:
    """Measure the scenes asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", nargs="+", default=["a"], metavar="SCENE", help="t, a, b, c or FILE.npz")
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the figures go")
    parser.add_argument(
        "--threads", type=int, metavar="N", help="threads (default: all cores this process may use)"
    )
    parser.add_argument("--repeat", type=int, default=15, metavar="N", help="runs a figure is the median of")
    options = parser.parse_args()
    if options.threads is not None:
        set_threads(options.threads)
        torch.set_num_threads(options.threads)
    scenes = [load(name) for name in options.scenes]
    rows = [measure(name, scene, source, options.repeat) for name, scene, source in scenes]
    peer = against_peer(scenes[0][1])
    print_table(rows, peer)
    if options.json:
        report = {
            "scenes": rows,
            "peer": peer,
            "machine": native_info(),
            "statistic": f"median of {options.repeat}",
        }
        options.json.write_text(json.dumps(report, indent=2) + "\n")


if __name__ == "__main__":
    main()
