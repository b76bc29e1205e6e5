"""``dreamdrive evaluate decomposition``: how well a scene tells what moves, against the world it is of."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from dreamdrive.cli.scene import open_scene
from dreamdrive.cli.terminal.console import plain
from dreamdrive.cli.terminal.machine import use_all_cores
from dreamdrive.cli.terminal.tables import check_files, fixed, print_table, write_json
from dreamdrive.files.given import SCENE, WORLD, check_there

if TYPE_CHECKING:
    from dreamdrive.evaluate import BoxError, Decomposition


def decomposition(
    out: Annotated[Positional[Path], arg(metavar="OUT")],
    world: Annotated[Positional[Path], arg(metavar="WORLD")],
    *,
    json: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None,
) -> None:
    """Measure how well a scene tells static from moving, against the simulated world that it is of.

    Args:
        out: The folder that generate wrote.
        world: The folder that world make wrote, or a layout, which is drawn again as the scene saw it.
        json: Write the figures to this file as well.
    """
    check_files(json=json)
    check_there(out, SCENE)
    check_there(world, WORLD)
    use_all_cores()
    from dreamdrive.evaluate import evaluate_decomposition, read_truth

    scene = open_scene(out)
    console = plain()
    with console.status("drawing the truth and looking at the scene"):
        figures = evaluate_decomposition(scene, read_truth(scene, world))
    title = f"{figures.frames} frames, {figures.width_px} px wide"
    print_table(console, title, ("figure", "value", "unit"), _rows(figures))
    if json is not None:
        write_json(json, figures)
        console.print(f"{json}")


def _rows(figures: "Decomposition") -> list[tuple[str, str, str]]:
    """The figures with their units, one a row; a dash for what has no meaning."""
    rows: list[tuple[str, str, str]] = []
    for name, found in (("pixels", figures.mask), ("Gaussians", figures.labels)):
        counts = f"{found.true} of {found.count} are moving ones"
        rows.append((f"{name}: IoU", fixed(found.iou, 3), counts))
        rows.append((f"{name}: precision", fixed(found.precision, 3), ""))
        rows.append((f"{name}: recall", fixed(found.recall, 3), ""))
        rows.append((f"{name}: average precision", fixed(found.average_precision, 3), ""))
    fake, actors = figures.fake, figures.actors
    rows.append(("static surface: fake motion", fixed(fake and fake.mean_m, 4), "m"))
    rows.append(("static surface: share that moves", fixed(fake and fake.moved_share, 2, 100), "%"))
    rows.append(("road users found", str(actors.found), f"of {actors.boxes} that move"))
    rows.append(("road users: place", fixed(actors.offset_median_m, 2), "m, median"))
    rows.append(("road users: way gone", fixed(actors.displacement_median_m, 2), "m, median error"))
    rows.append(("", fixed(actors.displacement_90_m, 2), "m, 90 % below"))
    rows += _of_boxes(figures.boxes) if figures.boxes is not None else []
    rows.append(("scale", fixed(figures.scale, 4), "true m for a metre of the scene"))
    rows.append(("path", fixed(figures.path_rms_m, 3), "m off, at this scale"))
    return rows


def _of_boxes(boxes: "BoxError") -> list[tuple[str, str, str]]:
    missed = ", ".join(f"{m.kind} {m.instance} in {m.missed} of {m.frames}" for m in boxes.misses)
    return [
        ("boxes of actors: place", fixed(boxes.position_median_m, 2), f"m, median of {boxes.pairs} pairs"),
        ("boxes of actors: heading", fixed(boxes.heading_median_deg, 1), "degrees, median"),
        ("", fixed(boxes.heading_5_deg, 0, 100), "% within 5 degrees"),
        ("boxes of actors: length", fixed(boxes.length_median_m, 2), "m, median error"),
        ("number of actors right", fixed(boxes.count_right, 0, 100), "% of frames, within one"),
        ("missed", str(len(boxes.misses)), f"{missed} frames" if missed else ""),
    ]
