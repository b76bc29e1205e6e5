"""``dreamdrive generate``: from a recording to a scene and its videos."""

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from rich.console import Console
from tyro.conf import Positional, UseAppendAction, arg

from dreamdrive.choices import (
    DeviceName,
    MethodName,
    QualityName,
    RepresentationName,
    Stage,
    TrafficName,
)
from dreamdrive.cli.arguments import (
    DataSetName,
    GeometryName,
    PriorName,
    parse_actions,
    parse_size,
    parse_view,
)
from dreamdrive.cli.machine import stop_like_an_interruption, use_all_cores
from dreamdrive.cli.progress import Bars

if TYPE_CHECKING:
    from dreamdrive.options import Options
    from dreamdrive.run import Outcome

_ROUGH = 3
"""Exit code of a result that is there and rough, for those who ask for one."""


def generate(
    input: Annotated[Positional[Path | None], arg(metavar="INPUT", help_behavior_hint="")] = None,
    *,
    out: Annotated[Path, arg(aliases=["-o"], metavar="DIR")],
    dataset: Annotated[DataSetName | None, arg(help_behavior_hint="")] = None,
    scene: Annotated[str | None, arg(metavar="NAME|N", help_behavior_hint="")] = None,
    cameras: Annotated[str | None, arg(metavar="all|NAME,...", help_behavior_hint="")] = None,
    prior: Annotated[PriorName | None, arg(help_behavior_hint="")] = None,
    geometry: Annotated[GeometryName | None, arg(help_behavior_hint="(default: classical)")] = None,
    weights: Annotated[str | None, arg(metavar="PATH|NAME", help_behavior_hint="")] = None,
    geometry_weights: Annotated[str | None, arg(metavar="PATH|NAME", help_behavior_hint="")] = None,
    knowledge: Annotated[str | None, arg(metavar="street|none|FILE", help_behavior_hint="")] = None,
    quality: QualityName = "standard",
    method: MethodName = "dreamdrive",
    frames: Annotated[str | None, arg(metavar="START:STOP:STEP", help_behavior_hint="")] = None,
    fps: Annotated[float | None, arg(metavar="F", help_behavior_hint="")] = None,
    size: Annotated[str | None, arg(metavar="WxH", help_behavior_hint="")] = None,
    intrinsics: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    poses: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    refine_poses: bool = False,
    geometry_files: Annotated[Path | None, arg(metavar="PATH", help_behavior_hint="")] = None,
    hfov: Annotated[float | None, arg(metavar="DEG", help_behavior_hint="")] = None,
    view: Annotated[str | None, arg(metavar="HEADING,PITCH", help_behavior_hint="")] = None,
    camera_height: Annotated[float | None, arg(metavar="M", help_behavior_hint="(default: 1.5)")] = None,
    trajectory: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    trajectories: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    action: Annotated[UseAppendAction[tuple[str, ...]], arg(metavar="TEXT")] = (),
    traffic: Annotated[TrafficName | None, arg(help_behavior_hint="(default: flow)")] = None,
    traffic_speed: Annotated[float | None, arg(metavar="M/S", help_behavior_hint="(default: 8)")] = None,
    fill: Annotated[str | None, arg(metavar="network|inpaint|FILE", help_behavior_hint="")] = None,
    prompt: Annotated[str | None, arg(metavar="TEXT", help_behavior_hint="")] = None,
    steps: Annotated[int | None, arg(metavar="N", help_behavior_hint="")] = None,
    features: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    hold_out: Annotated[int | None, arg(metavar="N", help_behavior_hint="")] = None,
    options: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    representation: Annotated[RepresentationName | None, arg(help_behavior_hint="(default: hybrid)")] = None,
    device: Annotated[DeviceName | None, arg(help_behavior_hint="(default: cpu)")] = None,
    seed: Annotated[int, arg(metavar="S")] = 0,
    recompute_from: Annotated[Stage | None, arg(name="from", help_behavior_hint="")] = None,
    force: bool = False,
    strict: bool = False,
) -> None:
    """Make a 4D scene and its videos from a recording or a layout.

    Args:
        input: A video, a folder of images or of several cameras (docs/guides/surround.md), a layout as JSON,
            or a photo; --prior street-world needs none.
        out: Output folder. The same command goes on where it stopped.
        dataset: How the recording lies on disk; without it that of dreamdrive's own that recognises INPUT.
        scene: Which drive of a data set, by its name or its number from 0: dreamdrive data list INPUT.
        cameras: Which of its cameras, such as front,front_left; without it the one that looks ahead, and of
            magicdrive all.
        prior: replay takes a recording as it is; street-world draws a layout, a scene of a data set, or a
            street of its own; photo drives into a photo; the others are video models, see
            docs/guides/priors.md. Without it the input decides.
        geometry: How cameras and depth are found. All but classical are networks and take --weights, some of
            them a package as well, which dreamdrive doctor names.
        weights: Weights of the network, the prior's or the geometry's: a file, a folder, or the name of a
            model that the hub's cache holds. Nothing is ever downloaded.
        geometry_weights: Weights of the geometry's network, where the prior has one too.
        knowledge: Weights of the street network, which sees depth, classes and road users in each frame:
            street, the default, are those that ship, none asks no network.
        quality: How many steps the fits take.
        method: dreamdrive is ours; paper takes the equations of the DreamDrive paper as printed.
        frames: Frames of the input to use, counted from 0.
        fps: Rate of the input, before the step of --frames.
        size: Size of the frames; without it 480 wide.
        intrinsics: Calibration of the camera: JSON for the size of the input, COLMAP model, transforms.json.
        poses: Known camera poses: JSON, TUM, KITTI or PandaSet.
        geometry_files: Known cameras, poses and depth, a file or its folder: COLMAP model, nerfstudio's
            transforms.json, cameras.json (ours, PandaSet's), KITTI or TUM poses; see
            docs/guides/geometry_files.md.
        refine_poses: Let given poses tell only how long the path is, and the frames how it runs: for poses of
            a positioning system, which are not exact between two frames.
        hfov: Horizontal field of view, where there is no calibration.
        view: What is taken out of a photo that is a panorama: degrees to the right of its middle, and up.
        camera_height: Height of the camera above the road in metres; fixes the metric scale.
        trajectory: Path that a video model shall drive, JSON or TUM, or that a replayed video was to drive:
            KITTI or PandaSet as well.
        trajectories: Several paths from the same first frame, a JSON list: each a drive of its own, all one
            scene.
        action: What a video model shall do instead: command=left; speed=8,8,8,8 wheel=0,0,0.1,0.1 (m/s and
            radians, left is positive, at 0.5, 1, 1.5 and 2 s); ahead=4,8,12,16 right=0,0,0,1 (m);
            goal=0.5,0.55 (shares of the photo's width and height). Given more than once, each is a drive of
            its own from the same first frame, and all become one scene.
        traffic: Whether the road users of a photo go on: vehicles along their lane, people along the street.
        traffic_speed: Speed of its vehicles in metres a second.
        fill: What fills what a photo does not show: inpaint, the default, is OpenCV, network one that ships;
            or a file of weights of dreamdrive train photo.
        prompt: What a video model shall show, in words.
        steps: Steps of a video model's sampler.
        features: Features of a recording's frames that another program computed, see docs/replay.md.
        hold_out: Withhold every N-th frame to measure how well it is predicted.
        options: Options of any stage as TOML, in place of those of the quality: docs/options.md.
        representation: hybrid tells static from moving; the others are its baselines: static Gaussians, a
            deformation network for all of them, feature planes (S3Gaussian), periodic vibration (PVG).
        device: Where networks and the fits are computed; cuda takes an NVIDIA GPU and gsplat (docs/gpu.md).
        seed: Seed of everything random.
        recompute_from: Compute this stage and all later ones again.
        force: Replace a result of other input or options; files that are not dreamdrive's are kept.
        strict: Exit with code 3 where the result is rough; it is kept.
    """
    use_all_cores()
    from dreamdrive.pipeline import generate as run
    from dreamdrive.scene.control import Control

    stop_like_an_interruption()
    control = Control(
        path=input,
        dataset=dataset,
        scene=scene,
        cameras=cameras,
        frames=frames,
        fps=fps,
        size=None if size is None else parse_size(size),
        intrinsics=intrinsics,
        poses=poses,
        hfov_deg=hfov,
        view=None if view is None else parse_view(view),
        trajectory=trajectory,
        trajectories=trajectories,
        **parse_actions(action),
        traffic=traffic,
        traffic_speed_m_s=traffic_speed,
        fill=fill,
        prompt=prompt,
        steps=steps,
        features=features,
        hold_out=hold_out,
        seed=seed,
    )
    chosen = _options(quality, method, options)
    found = _given(method=geometry, camera_height_m=camera_height, refine_poses=refine_poses or None)
    others = _given(representation=representation, device=device, knowledge=knowledge)
    chosen = replace(chosen, geometry=replace(chosen.geometry, **found), **others)
    console = Console(highlight=False, soft_wrap=True, markup=False)
    with Bars(console) as bars:
        outcome = run(
            control,
            out,
            prior=prior,
            geometry_files=geometry_files,
            weights=weights,
            geometry_weights=geometry_weights,
            options=chosen,
            recompute_from=recompute_from,
            force=force,
            progress=bars,
            say=console.print,
        )
    _tell(console, outcome, out, strict)


def _tell(console: Console, outcome: "Outcome", out: Path, strict: bool) -> None:
    """What became of it; a rough result ends the program where ``strict`` asks for that."""
    from dreamdrive.run import lines_of

    if outcome.already_finished:
        console.print(f"{out} is already finished; --from STAGE computes it again from a stage on")
    for line in lines_of(outcome):
        console.print(line)
    for what, name in (("scene", "scene"), ("videos", "video"), ("report", "report.json")):
        console.print(f"{what:<7} {out / name}")
    if strict and outcome.rough:
        sys.exit(_ROUGH)


def _options(quality: QualityName, method: MethodName, file: Path | None) -> "Options":
    """Those of the quality and the method, and in their place what the file says."""
    from dreamdrive.options import QUALITIES, with_method
    from dreamdrive.run import read_options

    chosen = with_method(QUALITIES[quality], method)
    return chosen if file is None else read_options(file, chosen)


def _given(**flags: Any) -> dict[str, Any]:
    """The flags that were given: these count more than the file of options."""
    return {name: value for name, value in flags.items() if value is not None}
