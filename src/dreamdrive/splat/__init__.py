"""F_splat: Gaussians to images and back."""

from dreamdrive.splat.arguments import check_dtype
from dreamdrive.splat.cuda import why_unusable
from dreamdrive.splat.rasterize import BACKENDS, rasterize
from dreamdrive.splat.scene_view import SceneView, moment_of, render_scene
from dreamdrive.splat.settings import native_info, set_threads, threads
from dreamdrive.splat.ssim import C1, C2, SIGMA_PX, WINDOW, ssim, ssim_map, ssim_map_reference
from dreamdrive.splat.torch_threads import one_torch_thread
from dreamdrive.splat.view import render, seen_by
