"""Memory that a fit takes on a GPU, told before it runs.

Parameters, moments and views are counted. What a step takes besides was found by running steps on the CPU
along the path of a GPU, with gsplat's kernels replaced by what they allocate, and adding up what lived at
once. Growth is no more than a step: its copies of the largest tensor are gone before the next step's
gradients are there. On a GPU it was not measured.
"""

from dataclasses import dataclass, replace
from math import sqrt

import torch

from dreamdrive.compute.machine import free_bytes
from dreamdrive.errors import InputError
from dreamdrive.motion import DeformationConfig, MotionConfig
from dreamdrive.scene.clip import Clip
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.splat import PACKED_ABOVE

_FLOAT = 4
_LEARNED = 11  # numbers of a Gaussian beside its colour: place, rotation, scales, opacity
_CARRIED = 32  # bytes of what is not learned: anchor, unit, source frame, and the growth's two sums
_VIEW = 10  # bytes a pixel of ``CompactView``
_MAPS = 360  # bytes a pixel: the picture, its gradient, the view at work, SSIM's planes
_TILES = 4  # that a Gaussian of a seed's size reaches; a list of them is sorted into another, 12 bytes each
_ENCODED = 76  # numbers that go into the deformation network
_MARGIN = 1.1  # for what the allocator cannot give back


@dataclass(frozen=True)
class FitSize:
    """What the memory of a fit depends on.

    Attributes:
        gaussians: All of them, at the most.
        moving: How many of these go through the motion.
        views: Training frames.
        size_px: Width and height of a frame.
        cameras: Of the rig; each sees another part of the Gaussians.
        coefficients: Of spherical harmonics, a channel.
        features: Numbers of Z_ref.
        motion: What moves them; None where nothing does.
    """

    gaussians: int
    moving: int
    views: int
    size_px: tuple[int, int]
    cameras: int = 1
    coefficients: int = 4
    features: int = 17
    motion: MotionConfig | None = None

    def smaller(self, share: float) -> "FitSize":
        """The same with this share of the pixels, and of the Gaussians, which come of these."""
        width, height = (max(2, 2 * int(side * sqrt(share) / 2)) for side in self.size_px)
        some = {name: int(share * getattr(self, name)) for name in ("gaussians", "moving")}
        return replace(self, size_px=(width, height), **some)


@dataclass(frozen=True)
class FitMemory:
    """Bytes of a fit at its peak.

    Attributes:
        parameters: The Gaussians, learned or carried along.
        moments: Adam's two of each number that is learned.
        splat: A step's own of each Gaussian: activated, projected, listed by tile, its gradients.
        network: What the motion keeps for its gradients.
        maps: A step's own of each pixel.
        views: All training frames.
    """

    parameters: int
    moments: int
    splat: int
    network: int
    maps: int
    views: int

    @property
    def living(self) -> int:
        """All of it."""
        return sum(vars(self).values())

    @property
    def peak(self) -> int:
        """All of it, with what the allocator holds besides."""
        return int(_MARGIN * self.living)

    def __str__(self) -> str:
        return ", ".join(f"{name} {count / 1e9:.1f} GB" for name, count in vars(self).items())


def plan_fit(size: FitSize) -> FitMemory:
    """What a fit of that size will take on a GPU."""
    count, pixels = size.gaussians, size.size_px[0] * size.size_px[1]
    colour = 3 * size.coefficients
    learned = _FLOAT * (_LEARNED + colour)
    return FitMemory(
        parameters=count * (learned + _CARRIED + _FLOAT * size.features),
        moments=2 * count * learned,
        splat=int(count * _splat_bytes(_FLOAT * colour, 1 / size.cameras if count > PACKED_ABOVE else None)),
        network=size.moving * _network_bytes(size.motion),
        maps=_MAPS * pixels,
        views=_VIEW * pixels * size.views,
    )


def check_fit(size: FitSize, free: int | None, least: bool = False) -> None:
    """Refuse a fit that ``free`` bytes cannot hold, naming a size that they can; None: nobody knows.

    Args:
        size: What will be fitted; with ``least`` it is an estimate, and the least that can be expected.
        free: Bytes that may be taken on the GPU.
        least: See there.

    Raises:
        InputError: It does not fit.
    """
    plan = plan_fit(size)
    if free is None or plan.peak <= free:
        return
    shares = (0.95**k for k in range(1, 60))
    found = next((s for share in shares if plan_fit(s := size.smaller(share)).peak <= free), None)
    smaller = "" if found is None else f"--size {found.size_px[0]}x{found.size_px[1]}, "
    width, height = size.size_px
    raise InputError(
        f"a fit of {'at least ' if least else ''}{size.gaussians:,} Gaussians to {size.views} frames at "
        f"{width}x{height} needs about {plan.peak / 1e9:.1f} GB of the GPU ({plan}), and {free / 1e9:.1f} GB "
        f"are free: give {smaller}fewer --frames, a larger stride_px of [seeds] in --options, or leave "
        "--device out for the CPU"
    )


def size_of(
    clip: Clip, static: Gaussians, dynamic: Gaussians | None, motion: MotionConfig | None, most: int
) -> FitSize:
    """The size of a fit to a clip, each of whose parts may grow to ``most`` Gaussians."""
    standing, moving = (max(len(part), most) if part else 0 for part in (static, dynamic or ()))
    some = static if standing or dynamic is None else dynamic
    return FitSize(
        gaussians=standing + moving,
        moving=moving,
        views=int((~clip.held_out).sum()),
        size_px=clip.size,
        cameras=len(clip.rig),
        coefficients=some.sh.shape[1],
        features=0 if some.features is None else some.features.shape[1],
        motion=motion,
    )


def check_holds(device: torch.device, size: FitSize) -> None:
    """``check_fit`` of a CUDA device; others are not asked."""
    if device.type == "cuda":
        check_fit(size, free_bytes(device))


def most_gaussians(size: FitSize, free: int) -> int:
    """How many Gaussians such a fit may have in so many bytes; those of ``size`` do not count."""
    low, high = 0, 10**9
    while high - low > 1:
        middle = (low + high) // 2
        fits = plan_fit(replace(size, gaussians=middle)).peak <= free
        low, high = (middle, high) if fits else (low, middle)
    return low


def _splat_bytes(colour: int, seen: float | None) -> float:
    """Bytes that a step takes a Gaussian whose colour takes so many; packed, of a share that is ``seen``.

    The most of two moments: the last gradients, with colours and theirs, or the list of tiles on the way
    there, with activated parameters and projections.
    """
    last = 165 + 2 * colour
    if seen is None:
        return max(last, 105 + colour + 24 * _TILES)
    return max(last, 60 + colour + seen * (121 + colour + 24 * _TILES))


def _network_bytes(motion: MotionConfig | None) -> int:
    """Bytes that a motion keeps of each Gaussian that goes through it."""
    if motion is None:
        return 0
    if not isinstance(motion, DeformationConfig):
        return 12 * getattr(motion, "width", 0)
    skip = 1.5 * (motion.width + _ENCODED) if motion.depth >= 6 else 0
    return int(_FLOAT * (motion.width * (motion.depth + 3) + _ENCODED + skip))
