"""``dreamdrive evaluate geometry``: how good cameras and depth are, against known poses and depth."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.console import Console
from tyro.conf import Positional, arg

from dreamdrive.cli.estimate import open_estimate
from dreamdrive.cli.tables import fixed, print_table, write_json

if TYPE_CHECKING:
    from dreamdrive.evaluate import DepthFigures, GeometryFigures


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
    from dreamdrive.evaluate import evaluate_geometry, read_geometry_truth
    from dreamdrive.show import draw_geometry_errors, write_png

    console = Console()
    with console.status("reading the truth and comparing"):
        estimate, missing = open_estimate(out)
        known = read_geometry_truth(truth, estimate)
        figures = evaluate_geometry(estimate, known)
    title = f"{figures.frames} frames, {figures.width_px} px wide, {figures.path_m:.1f} m of true path"
    print_table(console, title, ("figure", "value", "unit"), _rows(figures))
    if figures.depth is not None:
        _print_depth(console, figures.depth)
    for note in (*missing, *figures.notes):
        console.print(note, soft_wrap=True, highlight=False)
    if json is not None:
        write_json(json, {**asdict(figures), "notes": [*missing, *figures.notes]})
        console.print(f"{json}", soft_wrap=True)
    if picture is not None:
        median = figures.depth and figures.depth.median_scale
        write_png(picture, draw_geometry_errors(estimate, known, median or 1.0))
        console.print(f"{picture}", soft_wrap=True)


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
        means = [e and e.abs_rel, e and e.sq_rel_m, e and e.rmse_m, e and e.rmse_log]
        shares = [e and e.delta_1, e and e.delta_2, e and e.delta_3]
        texts = [*(fixed(v, 3) for v in means), *(fixed(v, 3) for v in shares)]
        rows.append((name, str(e.pixels) if e else "-", *texts))
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
