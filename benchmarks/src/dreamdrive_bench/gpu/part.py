"""One part in a process of its own: ``python -m dreamdrive_bench.gpu.part NAME --json FILE``."""

import argparse
import os
import subprocess
import sys
from pathlib import Path

import torch

from dreamdrive_bench.common.places import ROOT
from dreamdrive_bench.gpu.figures import Figures

TESTS = "tests/splat/test_splat_cuda.py"
PARTS = ("networks", "kernels", "fits", "two_cores", "steps", "generate", "profile")


def run(name: str, figures: Figures, pack: Path | None) -> None:
    """Measure one of ``PARTS``."""
    if name == "networks":
        from dreamdrive_bench.gpu.networks import measure

        measure(figures)
    elif name == "kernels":
        _tests(figures)
    elif name == "steps":
        _steps(figures)
    else:
        assert pack is not None, f"{name} needs a pack"
        _of_pack(name, figures, pack)


def _of_pack(name: str, figures: Figures, pack: Path) -> None:
    if name == "generate":
        from dreamdrive_bench.gpu import generated

        generated.measure(figures, pack)
    elif name == "profile":
        from dreamdrive_bench.gpu import profiled

        profiled.measure(figures, pack)
    else:
        from dreamdrive_bench.gpu import fits

        fits.measure(figures, pack, fits.CASES if name == "fits" else fits.ON_TWO_CORES)


def _tests(figures: Figures) -> None:
    """Those of the CUDA backend; where a GPU is pretended they are only collected."""
    what = ["--collect-only"] if figures.pretended else ["-m", "gpu"]
    command = [sys.executable, "-m", "pytest", "-q", *what, TESTS]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    lines = (done.stdout + done.stderr).strip().splitlines()
    figures.put("command", f"pytest {' '.join(command[4:])}")
    figures.put("summary", lines[-1:] if done.returncode == 0 else lines[-12:])
    if done.returncode:
        raise RuntimeError(f"pytest ended with {done.returncode}")


def _steps(figures: Figures) -> None:
    """The rows of ``gpu``; where a GPU is pretended, the scene alone."""
    from dreamdrive_bench.splat import gpu
    from dreamdrive_bench.splat.gpu_training import ssim_of_the_peer

    if figures.pretended:
        gaussians, _, poses = gpu.scene(96, 64, 500, "cpu")
        figures.put("rows", [{"gaussians": len(gaussians["means"]), "views": len(poses)}])
        return
    torch.backends.cudnn.allow_tf32 = False  # SSIM takes differences of squares
    gsplat = gpu.load_gsplat()
    figures.put("ssim_of_the_peer", ssim_of_the_peer()[0])
    figures.put("rows", [])
    for size in ((960, 576), (1920, 1080)):
        for count in (500_000, 2_000_000):
            with figures.attempt(f"{size[0]}x{size[1]}, {count}"):
                row = gpu.measure(gsplat, size, count, seconds=3.0)
                row |= {"not_the_same_work": gpu.disagreements(row)}
                figures.put("rows", [*figures.values["rows"], row])


def main() -> int:
    """Run the part that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", choices=PARTS)
    parser.add_argument("--json", type=Path, required=True, metavar="FILE")
    parser.add_argument("--pack", type=Path, metavar="FOLDER")
    parser.add_argument("--pretend", action="store_true")
    options = parser.parse_args()
    if options.name == "two_cores":
        os.environ["CUDA_VISIBLE_DEVICES"] = ""
        torch.set_num_threads(2)
    device = torch.device("cpu" if options.pretend or options.name == "two_cores" else "cuda")
    figures = Figures(options.json, device, options.pretend)
    with figures.attempt(options.name):
        run(options.name, figures, options.pack)
    return int("failed" in figures.values)


if __name__ == "__main__":
    sys.exit(main())
