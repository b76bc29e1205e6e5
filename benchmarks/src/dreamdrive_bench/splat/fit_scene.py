"""A fit in progress on a street of Gaussians: what a training step works on, made in a second from a seed."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from dreamdrive.fit import (
    DensifySettings,
    ExposureNetwork,
    FitOptions,
    GradientDensifier,
    LearningRates,
    Model,
    Parameters,
    Trainer,
    View,
    footprints,
)
from dreamdrive.motion import DeformationConfig, DeformationField, Domain, Tracks
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.gaussians import SH_C0, Gaussians
from dreamdrive.scene.sky import Sky
from dreamdrive.splat import render
from dreamdrive_bench.splat.streets import pinhole_of, street

ACTORS, FRAMES, INTERVAL_S = 3, 10, 0.1
# Full size, view-dependent colour, no densification: the step most of a long fit consists of.
OPTIONS, FIRST_STEP = FitOptions(steps=10_000), 7_000


@dataclass(frozen=True)
class FitScene:
    """What is fitted and against what.

    Attributes:
        static: Gaussians free of time.
        dynamic: Gaussians of the actors, all of which live at any time of the clip.
        tracks: Where the actors go.
        views: Frames of one camera.
        sky: The far background.
        source: Where the Gaussians come from.
    """

    static: Gaussians
    dynamic: Gaussians
    tracks: Tracks
    views: list[View]
    sky: Sky
    source: str

    def model(self) -> Model:
        """Everything the fit changes, at its start; the network's heads already do something."""
        centre = self.dynamic.means.mean(0).double().numpy()
        domain = Domain(centre, 20.0, 0.0, (FRAMES - 1) * INTERVAL_S, np.array([0.0, -1.0, 0.0]))
        config = DeformationConfig(actors=ACTORS, track_times=len(self.tracks.times_s))
        field = DeformationField(config, domain, self.tracks, 0)
        generator = torch.Generator().manual_seed(1)
        for head in (field.head_mean, field.head_quaternion, field.head_log_scale):
            torch.nn.init.normal_(head.weight, std=1e-3, generator=generator)
        static, dynamic = (
            Parameters(part, footprints(part), LearningRates()) for part in (self.static, self.dynamic)
        )
        return Model(static, dynamic, field, self.sky, ExposureNetwork(FRAMES, 0))

    def trainer(self) -> Trainer:
        """The real thing."""
        model, camera = self.model(), self.views[0].camera
        half_size = (camera.width_px / 2, camera.height_px / 2)
        densifiers = [GradientDensifier(DensifySettings(), len(p), half_size) for p in model.parts()]
        return Trainer(model, densifiers, OPTIONS, torch.Generator().manual_seed(0))


def make(width: int, height: int, count: int) -> FitScene:
    """A street of ``count`` Gaussians, a tenth of which are actors, seen at ``width`` x ``height`` pixels."""
    arrays, source = street(width, height, count)
    generator = torch.Generator().manual_seed(0)
    truth, camera = _gaussians(arrays), _camera(arrays)
    sky = Sky(0.7 + 0.2 * torch.rand(64, 256, 3, generator=generator), (-1.5, 2.0), (-0.8, 0.8))
    views = _views(truth, camera, sky)
    noise = {
        "means": 0.02 * torch.randn(count, 3, generator=generator),
        "sh": 0.1 * torch.randn(count, 4, 3, generator=generator),
    }
    start = truth.tensors()
    seeds = Gaussians(**start | {name: start[name] + value for name, value in noise.items()})
    actor = _actors(seeds.means, generator)
    rows = torch.nonzero(actor >= 0).squeeze(1)
    life = torch.tensor([0.5 * FRAMES * INTERVAL_S, FRAMES * INTERVAL_S]).expand(len(rows), 2)
    dynamic = Gaussians(
        **seeds.select(rows).tensors() | {"actor": actor[rows], "lifespan": life.contiguous()}
    )
    return FitScene(seeds.select(actor < 0), dynamic, _tracks(dynamic), views, sky, source)


def _gaussians(arrays: dict[str, np.ndarray]) -> Gaussians:
    tensors = {
        key: torch.from_numpy(np.array(arrays[key], np.float32)) for key in ("means", "quats", "scales")
    }
    opacities = torch.from_numpy(np.array(arrays["opacities"], np.float32))
    base = (torch.from_numpy(np.array(arrays["colors"], np.float32)) - 0.5) / SH_C0
    return Gaussians(
        means=tensors["means"],
        quaternions=tensors["quats"],
        log_scales=tensors["scales"].log(),
        logit_opacities=torch.logit(opacities),
        sh=torch.cat([base[:, None], torch.zeros(len(base), 3, 3)], dim=1),
        source_frame=torch.zeros(len(base), dtype=torch.int64),
    )


def _camera(arrays: dict[str, np.ndarray]) -> Camera:
    pose = np.linalg.inv(arrays["viewmat"].astype(np.float64))
    return Camera(**pinhole_of(arrays), world_from_camera=pose)


@torch.no_grad()
def _views(truth: Gaussians, camera: Camera, sky: Sky) -> list[View]:
    """The scene's own picture, depth and coverage as references; the lowest rows belong to a bonnet."""
    drawn = render(truth, camera)
    image = (drawn.colour + (1 - drawn.alpha)[..., None] * sky.colour(camera)).clamp(0, 1)
    mask = torch.ones(drawn.alpha.shape, dtype=torch.bool)
    mask[-len(mask) // 12 :] = False
    depth = drawn.depth_m / drawn.alpha.clamp(min=1e-3)
    trust = (drawn.alpha > 0.5).float()
    return [
        View(index, index * INTERVAL_S, camera, image, mask, drawn.alpha < 0.3, depth, trust)
        for index in range(FRAMES)
    ]


def _actors(means: Tensor, generator: torch.Generator) -> Tensor:
    """Index of the actor of each Gaussian (N,), -1 for none: those nearest to a few of them."""
    actor = torch.full((len(means),), -1)
    for index, seed in enumerate(torch.randperm(len(means), generator=generator)[:ACTORS].tolist()):
        distance = torch.linalg.vector_norm(means - means[seed], dim=1)
        distance[actor >= 0] = torch.inf
        actor[distance.argsort()[: len(means) // (10 * ACTORS)]] = index
    return actor


def _tracks(dynamic: Gaussians) -> Tracks:
    times_s = np.array([0.0, 0.4, 0.8])
    rng = np.random.default_rng(0)
    pivots = [dynamic.means[dynamic.actor == index].mean(0).numpy() for index in range(ACTORS)]
    return Tracks(
        times_s,
        rng.normal(0, 0.1, (ACTORS, len(times_s), 3)),
        rng.normal(0, 0.02, (ACTORS, len(times_s))),
        np.array(pivots, np.float64),
    )
