"""F_splat: Gaussians to images and back."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.scene.camera import NEAR_M as NEAR_M
    from dreamdrive.splat.arguments import check_dtype as check_dtype
    from dreamdrive.splat.cuda import (
        PACKED_ABOVE as PACKED_ABOVE,
        load_gsplat as load_gsplat,
        why_unusable as why_unusable,
    )
    from dreamdrive.splat.rasterize import BACKENDS as BACKENDS, rasterize as rasterize
    from dreamdrive.splat.scene_view import (
        Moment as Moment,
        Part as Part,
        SceneView as SceneView,
        moment_of as moment_of,
        render_scene as render_scene,
    )
    from dreamdrive.splat.settings import (
        native_info as native_info,
        set_threads as set_threads,
        stage_seconds as stage_seconds,
        threads as threads,
    )
    from dreamdrive.splat.shares import shares as shares
    from dreamdrive.splat.ssim import (
        C1 as C1,
        C2 as C2,
        SIGMA_PX as SIGMA_PX,
        WINDOW as WINDOW,
        blurred as blurred,
        mean_ssim as mean_ssim,
        ssim as ssim,
        ssim_map as ssim_map,
        ssim_map_reference as ssim_map_reference,
    )
    from dreamdrive.splat.view import render as render, seen_by as seen_by

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
