"""Random scenes with every kind of Gaussian, but none where the projection has no derivative."""

import math
from dataclasses import dataclass

import torch
from hypothesis import strategies as st
from torch import Tensor
from torch.nn.functional import normalize

from dreamdrive.scene.camera import NEAR_M
from dreamdrive.scene.harmonics import sh_basis
from dreamdrive.splat.arguments import SplatArguments
from dreamdrive.splat.reference import FAR_M, MIN_ALPHA, rotation_matrices
from tests.splat.scenes import IMAGES

KINDS = (
    "plain", "needle", "huge", "tiny", "flat", "near", "behind", "far", "beside", "opaque", "faint", "absent",
    "tied",
)  # fmt: skip
COUNTS = (1, 4, 9, 17, 30, 40, 50, 60, 100, 200)
SIZES_PX = ((40, 30), (16, 16), (17, 15), (100, 3), (2, 90), (33, 48), (1, 1), (19, 290), (300, 18))
CLEARANCE = 1e-4  # relative distance that float32 cannot cross


@dataclass(frozen=True)
class Case:
    """What a scene is made from; the numbers themselves come from the seed.

    Attributes:
        seed: Of the random numbers.
        n: Gaussians before those too close to a threshold are left out.
        kinds: Taken in turn.
        size_px: Image width and height.
        centre: Principal point as a share of the image.
        focal: Focal lengths as a share of the longer side, of 60 px at most: rounding grows with them.
        degree: SH degree evaluated.
        stored: SH degree stored, at least ``degree``.
        channels: Extra channels or None.
        offsets: Whether there are screen offsets.
        absolute: Whether absolute gradients by the projected centres are wanted.
        antialiased: As of ``rasterize``.
        inspect: As of ``rasterize``.
        pulled: Images that a gradient is pulled through.
    """

    seed: int
    n: int
    kinds: tuple[str, ...] = ("plain",)
    size_px: tuple[int, int] = (40, 30)
    centre: tuple[float, float] = (0.45, 0.55)
    focal: tuple[float, float] = (0.8, 0.85)
    degree: int = 1
    stored: int = 1
    channels: int | None = 2
    offsets: bool = True
    absolute: bool = False
    antialiased: bool = False
    inspect: bool = False
    pulled: tuple[str, ...] = IMAGES

    def camera(self) -> dict[str, float]:
        """The pinhole, as options of ``rasterize``."""
        (width, height), longer = self.size_px, min(max(*self.size_px, 4), 60)
        return {
            "fx_px": self.focal[0] * longer,
            "fy_px": self.focal[1] * longer,
            "cx_px": self.centre[0] * width,
            "cy_px": self.centre[1] * height,
            "width_px": width,
            "height_px": height,
        }


def cases(kinds: tuple[str, ...] = KINDS, most: int = 60) -> st.SearchStrategy[Case]:
    """Cases with up to ``most`` Gaussians, plain ones and some of ``kinds``."""
    share, focal = st.floats(-0.3, 1.3), st.floats(0.3, 3)
    degrees = st.tuples(st.integers(0, 3), st.integers(0, 3)).map(sorted)
    return st.builds(
        lambda degrees, **rest: Case(degree=degrees[0], stored=degrees[1], **rest),
        degrees=degrees,
        seed=st.integers(0, 2**20),
        n=st.sampled_from([n for n in COUNTS if n <= most]),
        kinds=st.lists(st.sampled_from(kinds), max_size=4, unique=True).map(lambda more: ("plain", *more)),
        size_px=st.sampled_from(SIZES_PX) | st.tuples(st.integers(1, 50), st.integers(1, 50)),
        centre=st.tuples(share, share),
        focal=st.tuples(focal, focal),
        channels=st.none() | st.integers(0, 5),
        offsets=st.booleans(),
        absolute=st.booleans(),
        antialiased=st.booleans(),
        inspect=st.booleans(),
        pulled=st.just(IMAGES) | st.sampled_from(IMAGES).map(lambda one: (one,)),
    )


def build(case: Case) -> dict[str, Tensor]:
    """The tensors of a case: numbers of float32 in float64, so that both precisions start from the same."""
    draw = _Draw(case.seed)
    camera, n = case.camera(), case.n
    kind = [case.kinds[i % len(case.kinds)] for i in range(n)]
    rotation, translation = draw.rotation(), draw.uniform(-1, 1, 3)
    centre_px = draw.uniform(-0.2, 1.2, n, 2) * torch.tensor(case.size_px)
    depth, footprint_px = draw.log_uniform(0.5, 20, n), draw.log_uniform(0.3, 10, n, 1)
    shape, opacity = draw.log_uniform(0.3, 1.5, n, 3), draw.uniform(0.05, 0.98, n)
    for i in range(n):
        match kind[i]:
            case "needle":
                shape[i] *= torch.tensor([40.0, 0.2, 0.2])
            case "huge":
                footprint_px[i] *= 1000
            case "tiny":
                footprint_px[i] *= 1e-4
            case "flat":
                shape[i, draw.below(3) :] = 0
            case "near":
                depth[i] = NEAR_M * draw.uniform(1 + 2 * CLEARANCE, 1.3)
            case "behind":
                depth[i] = (-depth[i], NEAR_M * (1 - 2 * CLEARANCE))[draw.below(2)]
            case "far":
                depth[i] = FAR_M * draw.uniform(0.5, 1.5)
            case "beside":
                centre_px[i] = draw.uniform(-3, 4, 2) * torch.tensor(case.size_px)
                footprint_px[i] *= 5
            case "opaque":  # and broad, so that some pixels lie under the cap of alpha
                opacity[i] = 1
                footprint_px[i] *= 5
            case "faint":
                opacity[i] = MIN_ALPHA * draw.uniform(0.5, 2)
            case "absent":
                opacity[i] = (0.0, 1e-30)[draw.below(2)]
    focal = torch.tensor([camera["fx_px"], camera["fy_px"]], dtype=torch.float64)
    principal = torch.tensor([camera["cx_px"], camera["cy_px"]], dtype=torch.float64)
    in_camera = torch.cat([(centre_px - principal) / focal, torch.ones(n, 1)], 1) * depth[:, None]
    means = (in_camera - translation) @ rotation
    for i in range(1, n):
        if kind[i] == "tied":
            means[i] = means[i - 1]
    scene = {
        "means": means,
        "quaternions": draw.normal(n, 4) * draw.log_uniform(0.1, 10, n, 1),
        "scales": shape * footprint_px * depth.abs()[:, None] / focal.max(),
        "opacities": opacity,
        "sh": 0.6 * draw.normal(n, (case.stored + 1) ** 2, 3),
        "camera_from_world": torch.eye(4, dtype=torch.float64),
    }
    scene["camera_from_world"][:3, :3], scene["camera_from_world"][:3, 3] = rotation, translation
    if case.channels is not None:
        scene["channels"] = draw.normal(n, case.channels)
    if case.offsets:
        scene["screen_offsets_px"] = draw.normal(n, 2)
    if case.absolute:
        scene["screen_absolute_px"] = torch.zeros(n, 2)
    scene = {name: value.float().double() for name, value in scene.items()}
    return select(scene, away_from_thresholds(arguments(case, scene)))


def select(scene: dict[str, Tensor], rows: Tensor) -> dict[str, Tensor]:
    """The scene with the Gaussians of ``rows`` (a mask or indices)."""
    return {name: value if name == "camera_from_world" else value[rows] for name, value in scene.items()}


def arguments(case: Case, scene: dict[str, Tensor]) -> SplatArguments:
    """What a backend is given."""
    camera = case.camera()
    return SplatArguments(
        **scene,
        focal_px=(camera["fx_px"], camera["fy_px"]),
        centre_px=(camera["cx_px"], camera["cy_px"]),
        size_px=case.size_px,
        sh_degree=case.degree,
        antialiased=case.antialiased,
    )


def away_from_thresholds(splat: SplatArguments) -> Tensor:
    """Which Gaussians (N,) rounding cannot carry past the near plane, each other, the clamp or black."""
    rotation, translation = splat.camera_from_world[:3, :3], splat.camera_from_world[:3, 3]
    in_camera = splat.means @ rotation.T + translation
    z = in_camera[:, 2]
    clear = (z / NEAR_M - 1).abs() > CLEARANCE
    for axis in range(2):
        focal, centre, size = splat.focal_px[axis], splat.centre_px[axis], splat.size_px[axis]
        for limit in (-(centre + 0.15 * size) / focal, (size - centre + 0.15 * size) / focal):
            clear &= (in_camera[:, axis] / z - limit).abs() > CLEARANCE
    basis = sh_basis(normalize(splat.means + rotation.T @ translation, dim=-1), splat.sh_degree)
    colours = torch.einsum("nk,nkc->nc", basis, splat.sh[:, : basis.shape[1]]) + 0.5
    clear &= (colours.abs() > CLEARANCE).all(1)
    order = torch.argsort(z, stable=True)
    gap = z[order].diff() / z[order][1:].abs()
    tied = (splat.means[order].diff(dim=0) == 0).all(1)
    clear[order[1:]] &= (gap > CLEARANCE) | tied
    return clear


class _Draw:
    """Random numbers of float64."""

    def __init__(self, seed: int) -> None:
        self._generator = torch.Generator().manual_seed(seed)

    def normal(self, *shape: int) -> Tensor:
        return torch.randn(shape, generator=self._generator, dtype=torch.float64)

    def uniform(self, low: float, high: float, *shape: int) -> Tensor:
        return low + (high - low) * torch.rand(shape, generator=self._generator, dtype=torch.float64)

    def log_uniform(self, low: float, high: float, *shape: int) -> Tensor:
        return self.uniform(math.log(low), math.log(high), *shape).exp()

    def below(self, n: int) -> int:
        return int(torch.randint(n, (), generator=self._generator))

    def rotation(self) -> Tensor:
        return rotation_matrices(self.normal(1, 4))[0]


def random_rotation(seed: int) -> tuple[Tensor, Tensor]:
    """A rotation matrix (3, 3) and its unit quaternion wxyz (4,)."""
    quaternion = normalize(_Draw(seed).normal(1, 4), dim=1)
    return rotation_matrices(quaternion)[0], quaternion[0]
