"""F_splat: Gaussians to images and back."""

from dreamdrive.splat.rasterize import BACKENDS, rasterize
from dreamdrive.splat.settings import native_info, set_threads, threads
from dreamdrive.splat.ssim import ssim, ssim_map
from dreamdrive.splat.torch_threads import one_torch_thread
from dreamdrive.splat.view import render

__all__ = [
    "BACKENDS",
    "native_info",
    "one_torch_thread",
    "rasterize",
    "render",
    "set_threads",
    "ssim",
    "ssim_map",
    "threads",
]
