"""Video models as priors: Stable Video Diffusion and Vista, one network on diffusers' classes."""

from dataclasses import replace
from functools import partial

from dreamdrive.errors import InputError
from dreamdrive.prior.protocol import Input, Prior
from dreamdrive.prior.running import INSTALL, PACKAGE
from dreamdrive.prior.vista.kinds import KINDS
from dreamdrive.progress import Progress
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.control import Driving, VideoModelInput, fields_of

_TAKES = fields_of(VideoModelInput) - {"fps", "prompt"}


def _make(kind: str, opened: Input, progress: Progress) -> Clip:
    try:
        from dreamdrive.prior.vista.make import make_clip
    except ImportError as error:
        raise InputError(f"prior {kind}: {error.name} cannot be imported ({error}): {INSTALL}") from None
    return make_clip(KINDS[kind], opened.control, progress)


SVD = Prior(
    name="svd",
    make=partial(_make, "svd"),
    takes=_TAKES - fields_of(Driving),
    gives="25 frames at 7 Hz, latents, features; no poses",
    about="a photo goes on for 25 frames (Stable Video Diffusion)",
    licence=(
        "code of diffusers Apache-2.0; weights under Stability AI's licence for Stable Video Diffusion, "
        "which limits commercial use"
    ),
    memory=(
        "at 1024x576 8.3 GB for the UNet in half precision (16.5 GB on a CPU, and hours) and 12.8 GB for "
        "the decoder, at 576x320 4.9 and 4.3 GB (reckoned, not measured); a run that does not fit is "
        "refused before it starts"
    ),
    weights="svd_xt.safetensors or the folder of stabilityai/stable-video-diffusion-img2vid-xt",
    package=PACKAGE,
    install=INSTALL,
)
VISTA = replace(
    SVD,
    name="vista",
    make=partial(_make, "vista"),
    takes=_TAKES,
    gives="22 frames a round and 3, at 10 Hz, latents, features; no poses",
    about="a street goes on from a photo or up to three frames, as told by an action (Vista)",
    licence=(
        "Vista's code and weights Apache-2.0 by its authors; the weights derive from Stable Video Diffusion, "
        "whose licence by Stability AI limits commercial use"
    ),
    weights="vista.safetensors of OpenDriveLab/Vista, or a folder that dreamdrive prior convert made of it",
)
