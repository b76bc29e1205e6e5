"""``dreamdrive generate``: from a recording to a scene and its videos."""

import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from rich.console import Console
from tyro.conf import OmitArgPrefixes, Positional, arg

from dreamdrive.cli.terminal.arguments import DEVICES, GeometryName, PriorName
from dreamdrive.cli.terminal.asked import asked
from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.machine import STARTED_S, use_all_cores
from dreamdrive.cli.terminal.progress import Bars
from dreamdrive.files.given import check_given
from dreamdrive.files.output import check_place
from dreamdrive.names import DeviceName, MethodName, QualityName, RepresentationName, Stage

if TYPE_CHECKING:
    from dreamdrive.options import Options
    from dreamdrive.run import Outcome

_ROUGH = 3
"""Exit code of a result that is there and rough, for those who ask for one."""


@dataclass(frozen=True)
class PriorFlags:
    """What makes the frames.

    Attributes:
        prior: replay takes a recording as it is; street-world draws a layout, a scene of a data set, or a
            street of its own; photo drives into a photo; the others are video models, see
            docs/guides/priors.md. Without it the input decides.
        weights: Weights of the network, the prior's or the geometry's: a file, a folder, or the name of a
            model that the hub's cache holds. Nothing is ever downloaded.
    """

    prior: Annotated[PriorName | None, arg(help_behavior_hint="")] = None
    weights: Annotated[str | None, arg(metavar="PATH|NAME", help_behavior_hint="")] = None


@dataclass(frozen=True)
class GeometryFlags:
    """Where cameras and depth come from, and what is known of them.

    Attributes:
        refine_poses: Let given poses tell only how long the path is, and the frames how it runs: for poses of
            a positioning system, which are not exact between two frames.
        geometry_files: Known cameras, poses and depth, a file or its folder: COLMAP model, nerfstudio's
            transforms.json, cameras.json (ours, PandaSet's), KITTI or TUM poses; see
            docs/guides/geometry_files.md.
        geometry: How cameras and depth are found. All but classical are networks and take --weights, some of
            them a package as well, which dreamdrive doctor names.
        geometry_weights: Weights of the geometry's network, where the prior has one too.
        knowledge: Weights of the street network, which sees depth, classes and road users in each frame:
            street, the default, are those that ship, none asks no network.
    """

    refine_poses: bool = False
    geometry_files: Annotated[Path | None, arg(metavar="PATH", help_behavior_hint="")] = None
    geometry: Annotated[GeometryName | None, arg(help_behavior_hint="(default: classical)")] = None
    geometry_weights: Annotated[str | None, arg(metavar="PATH|NAME", help_behavior_hint="")] = None
    knowledge: Annotated[str | None, arg(metavar="street|none|FILE", help_behavior_hint="")] = None


@dataclass(frozen=True)
class FitFlags:
    """How Gaussians are fitted.

    Attributes:
        method: dreamdrive is ours; paper takes the equations of the DreamDrive paper as printed.
        representation: hybrid tells static from moving; the others are its baselines: static Gaussians, a
            deformation network for all of them, feature planes (S3Gaussian), periodic vibration (PVG).
        options: Options of any stage as TOML, in place of those of the quality: docs/options.md.
        device: Where networks and the fits are computed; cuda takes an NVIDIA GPU and gsplat (docs/gpu.md).
    """

    method: MethodName = "dreamdrive"
    representation: Annotated[RepresentationName | None, arg(help_behavior_hint="(default: hybrid)")] = None
    options: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None
    device: Annotated[DeviceName | None, arg(metavar=DEVICES, help_behavior_hint="(default: cpu)")] = None


@dataclass(frozen=True)
class RunFlags:
    """What is done with results that are there already.

    Attributes:
        seed: Seed of everything random.
        recompute_from: Compute this stage and all later ones again.
        force: Replace a result of other input or options; files that are not dreamdrive's are kept.
        strict: Exit with code 3 where the result is rough; it is kept.
    """

    seed: Annotated[int, arg(metavar="S")] = 0
    recompute_from: Annotated[Stage | None, arg(name="from", help_behavior_hint="")] = None
    force: bool = False
    strict: bool = False


def generate(
    input: Annotated[Positional[Path | None], arg(metavar="INPUT", help_behavior_hint="")] = None,
    *,
    out: Annotated[Path, arg(aliases=["-o"], metavar="DIR")],
    quality: QualityName = "standard",
    camera_height: Annotated[float | None, arg(metavar="M", help_behavior_hint="(default: 1.5)")] = None,
    asked: asked("generate"),  # pyright: ignore[reportInvalidTypeForm]
    prior: OmitArgPrefixes[PriorFlags] = PriorFlags(),
    geometry: OmitArgPrefixes[GeometryFlags] = GeometryFlags(),
    fit: OmitArgPrefixes[FitFlags] = FitFlags(),
    run: OmitArgPrefixes[RunFlags] = RunFlags(),
) -> None:
    """Make a 4D scene and its videos from a recording or a layout.

    Args:
        input: A video, a folder of images or of several cameras (docs/guides/surround.md), a layout as JSON,
            or a photo; --prior street-world needs none.
        out: Output folder. The same command goes on where it stopped.
        quality: How many steps the fits take.
        camera_height: Height of the camera above the road in metres; fixes the metric scale.
        asked: What is asked of the input.
        prior: What makes the frames.
        geometry: Where cameras and depth come from.
        fit: How Gaussians are fitted.
        run: What is done with results that are there.
    """
    control = asked.control(input, run.seed)
    check_given(options=fit.options, geometry_files=geometry.geometry_files)
    check_place(out, input)
    use_all_cores()
    from dreamdrive.generate import generate as make

    console = plain()
    loading_s = time.perf_counter() - STARTED_S
    with Bars(console) as bars:
        outcome = make(
            control,
            out,
            prior=prior.prior,
            weights=prior.weights,
            geometry_files=geometry.geometry_files,
            geometry_weights=geometry.geometry_weights,
            options=_options(quality, camera_height, fit, geometry),
            recompute_from=run.recompute_from,
            force=run.force,
            progress=bars,
            say=console.print,
        )
    if not outcome.already_finished and outcome.whole_s is not None:
        outcome = replace(outcome, whole_s=outcome.whole_s + loading_s)
    _tell(console, outcome, out, run.strict)


def _tell(console: Console, outcome: "Outcome", out: Path, strict: bool) -> None:
    """What became of it; a rough result ends the program where ``strict`` asks for that."""
    from dreamdrive.run import lines_of, program_digest

    if outcome.already_finished:
        other = "" if outcome.program == program_digest() else ", by another version of the program"
        console.print(f"{out} is already finished{other}; --from STAGE computes it again from a stage on")
    for line in lines_of(outcome):
        console.print(line)
    for what, name in (("scene", "scene"), ("videos", "video"), ("report", "report.json")):
        console.print(f"{what:<7} {out / name}")
    if strict and outcome.rough:
        sys.exit(_ROUGH)


def _options(
    quality: QualityName, camera_height_m: float | None, fit: FitFlags, geometry: GeometryFlags
) -> "Options":
    """Those of quality and method, in their place what the file says, and in its place the flags."""
    from dreamdrive.options import QUALITIES, with_method
    from dreamdrive.run import read_options

    chosen = with_method(QUALITIES[quality], fit.method)
    chosen = chosen if fit.options is None else read_options(fit.options, chosen)
    told = {"method": geometry.geometry, "camera_height_m": camera_height_m}
    found = replace(chosen.geometry, **_given(told | {"refine_poses": geometry.refine_poses or None}))
    others = {name: getattr(fit, name) for name in ("representation", "device")}
    return replace(chosen, geometry=found, **_given(others | {"knowledge": geometry.knowledge}))


def _given(flags: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in flags.items() if value is not None}
