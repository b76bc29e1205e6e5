"""``dreamdrive evaluate video``: how real a set of clips looks."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.console import Console
from tyro.conf import OmitArgPrefixes, Positional, arg

from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.machine import use_all_cores
from dreamdrive.cli.terminal.progress import Bars
from dreamdrive.cli.terminal.tables import check_files, interval, number, print_table, write_json
from dreamdrive.files.given import CLIPS, check_there
from dreamdrive.names import Covariance, Resize, Stlpips

if TYPE_CHECKING:
    from dreamdrive.evaluate import VideoReport

_File = Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")]


@dataclass(frozen=True)
class WeightFlags:
    """Weights that the user has; figures without theirs are left out.

    Attributes:
        inception: Weights of FID.
        i3d: Weights of FVD.
        lpips_trunk: Weights of VGG16 or AlexNet for LPIPS.
        lpips_heads: Heads of LPIPS v0.1 for the same network.
        transnet: Weights of TransNetV2, where its package is not installed.
    """

    inception: _File = None
    i3d: _File = None
    lpips_trunk: _File = None
    lpips_heads: _File = None
    transnet: _File = None


@dataclass(frozen=True)
class SettingFlags:
    """How clips are compared; figures of different settings are not comparable.

    Attributes:
        window: Frames that a figure of video describes at once; 0 leaves these figures out.
        stride: Frames from one window to the next; without it the window.
        resize: How images are brought to the size of Inception.
        covariance: Divide covariances by N - 1 or by N.
        stlpips: Trunk of the shift-tolerant LPIPS; vgg takes four times as long.
        resamples: Resamples of the clips behind each interval; 0 leaves the intervals out.
        seed: Seed of everything random.
    """

    window: Annotated[int, arg(metavar="FRAMES")] = 16
    stride: Annotated[int | None, arg(metavar="FRAMES", help_behavior_hint="")] = None
    resize: Resize = "tf1"
    covariance: Covariance = "sample"
    stlpips: Stlpips = "alex"
    resamples: Annotated[int, arg(metavar="N")] = 200
    seed: Annotated[int, arg(metavar="S")] = 0


def evaluate_video(
    real: Annotated[Positional[Path], arg(metavar="REAL")],
    fake: Annotated[Positional[Path], arg(metavar="FAKE")],
    *,
    weights: OmitArgPrefixes[WeightFlags] = WeightFlags(),
    settings: OmitArgPrefixes[SettingFlags] = SettingFlags(),
    json: _File = None,
) -> None:
    """Compare clips with real ones: Fréchet and kernel distances, PSNR, SSIM, perceptual distances.

    Args:
        real: A folder of clips (sub-folders of images, or videos), or one clip.
        fake: The same; clips of equal names belong together.
        weights: Those of the networks.
        settings: How clips are compared.
        json: Write all figures and settings there.
    """
    check_files(json=json)
    for path in (real, fake):
        check_there(path, CLIPS)
    use_all_cores()
    from dreamdrive import __version__
    from dreamdrive.evaluate import VideoSettings, WeightFiles, evaluate_video as run

    wanted, files = VideoSettings(**vars(settings)), WeightFiles(**vars(weights))
    console = plain()
    with Bars(console) as bars:
        report = run(real, fake, wanted, files, bars)
    show(console, report)
    if json is not None:
        write_json(json, {"version": __version__, **asdict(report)})
        console.print(f"figures: {json}")


def show(console: Console, report: "VideoReport") -> None:
    """Print the figures of a report, and what is missing."""
    if report.distances:
        print_table(
            console,
            "distance of the sets (N and clips: real / fake)",
            ("", "value", "95 % over clips", "floor", "of halves", "N", "clips"),
            [
                (
                    name,
                    number(figure.value),
                    interval(figure.low, figure.high),
                    number(figure.floor),
                    number(figure.half),
                    f"{figure.real_samples} / {figure.fake_samples}",
                    f"{figure.real_clips} / {figure.fake_clips}",
                )
                for name, figure in report.distances.items()
            ],
        )
        console.print("floor: one half of the real set to the other; compare with 'of halves'")
    if report.likenesses:
        print_table(
            console,
            "likeness of paired frames",
            ("", "mean", "95 % over clips", "frames", "clips"),
            [
                (name, number(f.value), interval(f.low, f.high), str(f.frames), str(f.clips))
                for name, f in report.likenesses.items()
            ],
        )
    for name, why in report.not_computed.items():
        console.print(f"not computed: {name}: {why}")
