"""``dreamdrive evaluate geometry``: how good cameras and depth are, against known poses and depth."""

from dataclasses import asdict, astuple
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

from rich.console import Console
from tyro.conf import Positional, arg

from dreamdrive.cli.scene import open_scene
from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.tables import check_files, fixed, print_table, write_json
from dreamdrive.errors import InputError
from dreamdrive.files.given import SCENE, TRUTH, check_there
from dreamdrive.files.paths import inside

if TYPE_CHECKING:
    from dreamdrive.evaluate import DepthFigures, Estimate, GeometryFigures
    from dreamdrive.scene.clip import Clip
    from dreamdrive.scene.geometry import Geometry

T = TypeVar("T")


def geometry(
    out: Annotated[Positional[Path], arg(metavar="SCENE_OR_OUT")],
    *,
    truth: Annotated[Path, arg(metavar="PATH", help_behavior_hint="(required)")],
    json: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
    picture: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
) -> None:
    """Measure how good cameras and depth are, against known poses and lidar or exact depth.

    Args:
        out: The folder that generate wrote; of a scene folder alone the cameras are measured.
        truth: A world folder or a layout, a recording with PandaSet's cameras.json, or one with poses.txt and
            meta.json, such as KITTI's.
        json: Write the figures to this file as well.
        picture: Draw errors of depth and both paths into this PNG.
    """
    check_files(json=json, picture=picture)
    check_there(out, SCENE)
    check_there(truth, TRUTH)
    from dreamdrive.evaluate import draw_geometry_errors, evaluate_geometry, read_geometry_truth
    from dreamdrive.show import write_png

    console = plain()
    with console.status("reading the truth and comparing"):
        estimate, missing = open_estimate(out)
        known = read_geometry_truth(truth, estimate)
        figures = evaluate_geometry(estimate, known)
    title = f"{figures.frames} frames, {figures.width_px} px wide, {figures.path_m:.1f} m of true path"
    print_table(console, title, ("figure", "value", "unit"), _rows(figures))
    if figures.depth is not None:
        _print_depth(console, figures.depth)
    for note in (*missing, *figures.notes):
        console.print(note)
    if json is not None:
        write_json(json, {**asdict(figures), "notes": [*missing, *figures.notes]})
        console.print(f"{json}")
    if picture is not None:
        median = figures.depth and figures.depth.median_scale
        write_png(picture, draw_geometry_errors(estimate, known, median or 1.0))
        console.print(f"{picture}")


def _rows(figures: "GeometryFigures") -> list[tuple[str, str, str]]:
    """Path, scale and pinhole with their units, one a row; a dash for what has no meaning."""
    path, scale, pinhole = figures.path, figures.scale, figures.pinhole
    against = "" if pinhole is None else f", {pinhole.focal_px:.1f} for {pinhole.true_focal_px:.1f} px"
    guessed = ", guessed" if pinhole is not None and pinhole.observed is False else ""
    return [
        ("path: distance (ATE)", fixed(path and path.ate_m, 3), "m"),
        ("", fixed(path and path.ate_percent, 2), "% of the path"),
        ("path: translation (RPE)", fixed(path and path.translation_percent, 2), "% of a stretch"),
        ("path: rotation (RPE)", fixed(path and path.rotation_deg_per_m, 4), "deg/m"),
        ("scale of the path", fixed(scale and scale.metres_per_unit, 4), "true m for a unit of the scene"),
        ("scale: lengths of the scene", _signed(scale and scale.error_percent), "% too long"),
        ("focal length", _signed(pinhole and pinhole.focal_percent), f"% too long{against}{guessed}"),
        ("principal point", fixed(pinhole and pinhole.principal_px, 2), "px off"),
    ]


def _signed(percent: float | None) -> str:
    return "-" if percent is None else f"{percent:+.2f}"


def _print_depth(console: Console, depth: "DepthFigures") -> None:
    """Errors of all pixels in full, those of the groups in short, and what the confidence is worth."""
    whole = depth.groups[0]
    columns = ("depth", "pixels", "AbsRel", "SqRel m", "RMSE m", "RMSE log", "<1.25", "<1.25^2", "<1.25^3")
    rows: list[tuple[str, ...]] = []
    for name, e in (
        ("as it is", whole.as_is),
        ("scale of the path", whole.path_scale),
        ("median scale", whole.median_scale),
    ):
        pixels, *errors = astuple(e) if e else [None] * (len(columns) - 1)
        rows.append((name, fixed(pixels, 0), *(fixed(error, 3) for error in errors)))
    title = f"{depth.frames} frames with true depth; median scale {fixed(depth.median_scale, 4)}"
    console.print()
    print_table(console, title, columns, rows)
    console.print()
    print_table(
        console,
        "",
        ("pixels", "true", "coverage %", "AbsRel as it is", "path scale", "median scale", "<1.25"),
        [
            (
                group.name,
                str(group.true),
                fixed(group.coverage, 1, 100),
                *(fixed(e and e.abs_rel, 3) for e in (group.as_is, group.path_scale, group.median_scale)),
                fixed(group.median_scale and group.median_scale.delta_1, 3),
            )
            for group in depth.groups
        ],
    )
    if depth.trust is not None:
        names = [f"{100 * share:.0f} %" for share in depth.trust.shares]
        values = [fixed(value, 3) for value in depth.trust.abs_rel]
        console.print()
        columns = ("most trusted", *names, "rank correlation")
        found = [("AbsRel, median scale", *values, fixed(depth.trust.rank_correlation, 3))]
        print_table(console, "", columns, found)


def open_estimate(out: Path) -> "tuple[Estimate, tuple[str, ...]]":
    """Cameras and depth in an output folder of ``generate``, or the cameras of a scene folder elsewhere.

    A run that was stopped after its geometry is enough. Told is also what is missing, a sentence each.
    """
    from dreamdrive.evaluate import Estimate
    from dreamdrive.scene.clip import Clip
    from dreamdrive.scene.geometry import Geometry

    if out.name == "scene" and (out / "scene.json").is_file():
        out = out.parent
    geometry = _stage(inside(out, "stages/geometry"), Geometry)
    clip = None if (out / "scene").is_dir() else _stage(inside(out, "stages/prior"), Clip)
    if geometry is not None and clip is not None:
        _check_agreement(out, clip, geometry)
        taken = clip.recorded
        lens = taken is not None and taken.lens is not None
        name = None if taken is None else Path(taken.path).resolve().name
        made = Estimate.of(
            geometry, clip.times_s, clip.held_out, clip.source_index, source=name, undistorted=lens
        )
        return made, ()
    return _of_scene(out, geometry)


def _of_scene(out: Path, geometry: "Geometry | None") -> "tuple[Estimate, tuple[str, ...]]":
    """A finished scene, with the geometry it was made from where that was kept."""
    import numpy as np

    from dreamdrive.evaluate import Estimate

    scene = open_scene(out)
    about = scene.provenance
    index = np.array(about.source_index or range(len(scene.cameras)), dtype=np.int64)
    source, lens = about.input, about.lens is not None
    if geometry is None:
        missing = (
            f"{out / 'stages' / 'geometry'} is not there: depth, confidence and what fixed the scale cannot "
            "be measured; run generate again with the same options to have them."
        )
        made = Estimate(scene.cameras, scene.held_out, index, scene.times_s, source=source, undistorted=lens)
        return made, (missing,)
    same = len(geometry.cameras) == len(scene.cameras) and all(
        a.matrix.tolist() == b.matrix.tolist() and np.allclose(a.world_from_camera, b.world_from_camera)
        for a, b in zip(geometry.cameras, scene.cameras, strict=True)
    )
    if not same:
        raise InputError(
            f"{out} holds a scene and the geometry of another run: their cameras differ; finish that run, or "
            "run generate again with the options of the scene"
        )
    return Estimate.of(geometry, scene.times_s, scene.held_out, index, source=source, undistorted=lens), ()


def _check_agreement(out: Path, clip: "Clip", geometry: "Geometry") -> None:
    from dreamdrive.stored import check

    try:
        check.clip(clip)
        check.geometry(clip, geometry)
    except ValueError as error:
        raise InputError(f"{out}: its stages do not belong together ({error}); run generate again") from error


def _stage(folder: Path, kind: type[T]) -> T | None:
    """What a stage left; None where there is nothing."""
    from dreamdrive.run import codec

    if not (folder / codec.JSON_NAME).is_file():
        return None
    try:
        return codec.read(folder, kind)
    except codec.DamagedError as error:
        raise InputError(f"{folder} is damaged ({error}); run generate again to compute it anew") from error
