"""Figures of how real clips look: FID, FVD and their relatives, PSNR, SSIM, LPIPS."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from dreamdrive.data.source import Source
from dreamdrive.errors import InputError
from dreamdrive.evaluate.clips.bootstrap import (
    MIN_SAMPLES,
    RESAMPLES,
    DistanceFigure,
    distance_with_interval,
    mean_with_interval,
)
from dreamdrive.evaluate.clips.clips import open_clips, pairs_of, read_frames
from dreamdrive.evaluate.clips.extractors import Extractor, Frames, Toolbox, WeightFiles, open_toolbox
from dreamdrive.evaluate.clips.frechet import frechet_distance, kernel_distance
from dreamdrive.evaluate.networks import MIN_FRAMES
from dreamdrive.names import Covariance, Resize, Stlpips

MIN_SIDE_PX = 32
"""Below this nothing is left of an image after the strides of the networks."""

Progress = Callable[[str, int, int], None]
"""Called with what is done, clips done and clips in all."""


@dataclass(frozen=True)
class VideoSettings:
    """How clips are compared; figures of different settings are not comparable.

    Attributes:
        window: Frames of a clip that figures of video describe at once; 0 leaves those figures out.
        stride: Frames from one window to the next; without it the window. A remainder is dropped.
        resize: How images are brought to the size of Inception.
        covariance: Normaliser of the covariances.
        seed: Of everything random.
        resamples: Resamples of clips behind each interval; 0 leaves the intervals out.
        stlpips: Trunk of the shift-tolerant LPIPS.
    """

    window: int = 16
    stride: int | None = None
    resize: Resize = "tf1"
    covariance: Covariance = "sample"
    seed: int = 0
    resamples: int = RESAMPLES
    stlpips: Stlpips = "alex"

    def __post_init__(self) -> None:
        if self.window < 0:
            raise InputError(
                f"--window {self.window}: expected a number of frames, or 0 for no video figures"
            )
        if self.stride is not None and self.stride < 1:
            raise InputError(f"--stride {self.stride}: expected 1 frame or more")
        if self.resamples < 0:
            raise InputError(f"--resamples {self.resamples}: expected 0 or more")


@dataclass(frozen=True)
class MeanFigure:
    """A likeness averaged over all pairs of frames, which infinite PSNR of equal frames makes infinite.

    Low and high are the ends of its 95 % interval over clips; ``None`` where it cannot be told.
    """

    value: float
    low: float | None
    high: float | None
    frames: int
    clips: int


@dataclass(frozen=True)
class VideoReport:
    """What ``evaluate_video`` found.

    Attributes:
        real: Where the real clips are.
        fake: Where the others are.
        settings: How they were compared.
        size: Width and height of all frames.
        paired: Whether clip i of one set belongs to clip i of the other.
        distances: By name, how far the sets are from each other.
        likenesses: By name, how like each other paired frames are.
        not_computed: Figures that are missing, and why.
        weights: File and sha256 behind each figure with a network.
    """

    real: str
    fake: str
    settings: VideoSettings
    size: tuple[int, int]
    paired: bool
    distances: dict[str, DistanceFigure]
    likenesses: dict[str, MeanFigure]
    not_computed: dict[str, str]
    weights: dict[str, dict[str, str]]


def evaluate_video(
    real: Path,
    fake: Path,
    settings: VideoSettings | None = None,
    files: WeightFiles | None = None,
    progress: Progress | None = None,
) -> VideoReport:
    """Compare a set of clips with real ones by every figure whose weights are there.

    A set is a folder of clips (sub-folders of images, or videos), or one clip. Clips of equal names belong
    together; so do two single clips.

    Raises:
        InputError: Clips or weights that cannot be used.
    """
    settings = settings or VideoSettings()
    if files is not None and files.i3d is not None and 0 < settings.window < MIN_FRAMES:
        raise InputError(f"--window {settings.window}: FVD needs {MIN_FRAMES} frames or more")
    real_clips, fake_clips = open_clips(real), open_clips(fake)
    box = open_toolbox(
        files or WeightFiles(),
        resize=settings.resize,
        windows=settings.window > 0,
        stlpips_kind=settings.stlpips,
    )
    found = _Found(box, settings, progress or (lambda what, done, total: None))
    pairs = pairs_of(real_clips, fake_clips)
    paired = not isinstance(pairs, str)
    if isinstance(pairs, str):
        found.unlike = pairs
        found.visit(real_clips, fake_clips)
    else:
        found.visit_pairs([(real_clips[a], fake_clips[b]) for a, b in pairs])
    return VideoReport(
        real=str(real),
        fake=str(fake),
        settings=settings,
        size=found.size,
        paired=paired,
        distances=found.distances(paired),
        likenesses={} if found.unlike else found.means(),
        not_computed=box.missing | found.missing(),
        weights=box.weights,
    )


@dataclass
class _Found:
    """What has been seen so far of both sets."""

    box: Toolbox
    settings: VideoSettings
    progress: Progress
    size: tuple[int, int] = (0, 0)
    unlike: str | None = None
    real: dict[str, list[Float[np.ndarray, "_ _"]]] = field(default_factory=dict)
    fake: dict[str, list[Float[np.ndarray, "_ _"]]] = field(default_factory=dict)
    likenesses: dict[str, list[Float[np.ndarray, " _"]]] = field(default_factory=dict)

    def visit(self, real: Mapping[str, Source], fake: Mapping[str, Source]) -> None:
        """Take the features of two sets that have nothing to do with each other."""
        total = len(real) + len(fake)
        sources = [(s, self.real) for s in real.values()] + [(s, self.fake) for s in fake.values()]
        for done, (source, features) in enumerate(sources):
            self._extract(source, self._read(source), features)
            self.progress("features", done + 1, total)

    def visit_pairs(self, pairs: list[tuple[Source, Source]]) -> None:
        """Take the features of both sets, and compare frame by frame."""
        for done, (real, fake) in enumerate(pairs):
            a, b = self._read(real), self._read(fake)
            self._extract(real, a, self.real)
            self._extract(fake, b, self.fake)
            if len(a) != len(b):
                self.unlike = f"{real.path} has {len(a)} frames, {fake.path} has {len(b)}"
            if self.unlike is None:
                for name, compare in self.box.likenesses.items():
                    self.likenesses.setdefault(name, []).append(compare(a, b))
            self.progress("clips", done + 1, len(pairs))

    def distances(self, paired: bool) -> dict[str, DistanceFigure]:
        """Figures of the sets as wholes."""
        seed, resamples = self.settings.seed, self.settings.resamples
        distance = partial(distance_with_interval, paired=paired, seed=seed, resamples=resamples)
        frechet = partial(frechet_distance, covariance=self.settings.covariance)
        kernel = partial(kernel_distance, seed=seed)
        figures: dict[str, DistanceFigure] = {}
        for extractor in self.box.extractors:
            real, fake = self.real[extractor.frechet], self.fake[extractor.frechet]
            if not self.too_few(extractor):
                figures[extractor.frechet] = distance(real, fake, frechet)
                figures[extractor.kernel] = distance(real, fake, kernel)
        return figures

    def too_few(self, extractor: Extractor) -> str | None:
        """Why the sets have no distance of these features, if they have none."""
        real, fake = (sum(map(len, f[extractor.frechet])) for f in (self.real, self.fake))
        if min(real, fake) >= MIN_SAMPLES:
            return None
        what = "windows" if extractor.window else "frames"
        return f"{real} real and {fake} fake {what}; a distance with its floor needs {MIN_SAMPLES} or more"

    def missing(self) -> dict[str, str]:
        """Figures that these sets have not, and why."""
        likenesses = {} if self.unlike is None else dict.fromkeys(self.box.likenesses, self.unlike)
        reasons = {f"{e.frechet}, {e.kernel}": self.too_few(e) for e in self.box.extractors}
        return likenesses | {name: why for name, why in reasons.items() if why is not None}

    def means(self) -> dict[str, MeanFigure]:
        """Figures of paired frames."""
        figures: dict[str, MeanFigure] = {}
        for name, values in self.likenesses.items():
            mean = mean_with_interval(values, seed=self.settings.seed, resamples=self.settings.resamples)
            figures[name] = MeanFigure(*mean, sum(map(len, values)), len(values))
        return figures

    def _read(self, source: Source) -> Frames:
        frames = read_frames(source)
        size = (frames.shape[2], frames.shape[1])
        if self.size == (0, 0):
            self.size = size
        if size != self.size:
            raise InputError(
                f"{source.path} is {size[0]}x{size[1]}, the clips before are {self.size[0]}x{self.size[1]}; "
                "bring both sets to one size, by the same resampling"
            )
        if min(size) < MIN_SIDE_PX:
            raise InputError(f"{source.path} is {size[0]}x{size[1]}; expected {MIN_SIDE_PX} pixels or more")
        return torch.from_numpy(frames)

    def _extract(
        self, source: Source, frames: Frames, features: dict[str, list[Float[np.ndarray, "_ _"]]]
    ) -> None:
        for extractor in self.box.extractors:
            rows = self._rows(extractor, frames, source.path)
            features.setdefault(extractor.frechet, []).append(rows)

    def _rows(self, extractor: Extractor, frames: Frames, path: Path) -> Float[np.ndarray, "n d"]:
        if not extractor.window:
            return extractor.features(frames)
        parts = windows(frames, self.settings.window, self.settings.stride)
        if not parts:
            raise InputError(
                f"{path} has {len(frames)} frames, fewer than a window of {self.settings.window}; use longer "
                "clips, a smaller --window, or --window 0 to leave the figures of video out"
            )
        return np.concatenate([extractor.features(part) for part in parts])


def windows(frames: Frames, length: int, stride: int | None = None) -> list[Tensor]:
    """Windows of so many frames, by default one behind the other; a remainder is dropped."""
    starts = range(0, len(frames) - length + 1, stride or length)
    return [frames[start : start + length] for start in starts]
