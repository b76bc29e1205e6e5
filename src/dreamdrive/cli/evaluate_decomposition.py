"""``dreamdrive evaluate decomposition``: how well a scene tells what moves, against the world it is of."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.console import Console
from tyro.conf import Positional, arg

from dreamdrive.cli.machine import use_all_cores
from dreamdrive.cli.scene import open_scene
from dreamdrive.cli.tables import fixed, print_table, write_json
from dreamdrive.errors import InputError

if TYPE_CHECKING:
    from dreamdrive.evaluate import Decomposition, Truth
    from dreamdrive.scene.scene import Scene


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
    use_all_cores()
    from dreamdrive.evaluate import evaluate_decomposition

    scene = open_scene(out)
    console = Console()
    with console.status("drawing the truth and looking at the scene"):
        figures = evaluate_decomposition(scene, _truth(scene, world))
    title = f"{figures.frames} frames, {figures.width_px} px wide"
    print_table(console, title, ("figure", "value", "unit"), _rows(figures))
    if json is not None:
        write_json(json, figures.to_json())
        console.print(f"{json}", soft_wrap=True)


def _truth(scene: "Scene", world: Path) -> "Truth":
    """The truth of the scene's frames."""
    from dreamdrive.data.layout_file import read_layout
    from dreamdrive.evaluate import Truth
    from dreamdrive.world import drive, read_world

    if not world.exists():
        raise InputError(f"{world} does not exist; expected a folder of dreamdrive world make, or a layout")
    index = [int(i) for i in scene.provenance.source_index or range(len(scene.cameras))]
    if world.is_dir():
        made = read_world(world)
    else:
        size = (scene.cameras[0].width_px, scene.cameras[0].height_px)
        made = drive(read_layout(world), max(index) + 1, _rate_hz(scene, index), size)
    if max(index) >= len(made.frames):
        raise InputError(
            f"{world} has {len(made.frames)} frames but the scene shows frame {max(index)}; "
            "give the world that the scene was made from"
        )
    return Truth.of(made, index)


def _rate_hz(scene: "Scene", index: list[int]) -> float:
    """Frames of the source in a second; of a single frame there is no other."""
    span_s = float(scene.times_s[-1] - scene.times_s[0])
    return (index[-1] - index[0]) / span_s if span_s > 0 else 10.0


def _rows(figures: "Decomposition") -> list[tuple[str, str, str]]:
    """The figures with their units, one a row; a dash for what has no meaning."""
    rows: list[tuple[str, str, str]] = []
    for name, found, of in (
        ("pixels", figures.mask, "moving ones"),
        ("Gaussians", figures.labels, "moving ones"),
    ):
        rows.append((f"{name}: IoU", fixed(found.iou, 3), f"{found.true} of {found.count} are {of}"))
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
    rows.append(("scale", fixed(figures.scale, 4), "true m for a metre of the scene"))
    rows.append(("path", fixed(figures.path_rms_m, 3), "m off, at this scale"))
    return rows
