"""Photos from anywhere become drives: what each scene is worth, beside other priors.

A manifest is a JSON list of places: name, file, and where known view (heading and pitch out of a panorama),
hfov_deg, camera_height_m, actions. The paper took 20 places of Google Street View, which everybody has to
fetch for themselves; twenty_places.json beside this module is such a manifest, to be filled. Of a folder
every photo counts.

For each place and prior: seconds, how well the scene shows the frames it was made of, how much is uncovered 1
m aside, how well the decomposition finds what was set in motion, how precisely the rendered drive follows its
path, and the pictures. For each prior: the Frechet distances of its rendered drives to the photos. Vista
takes DREAMDRIVE_VISTA. Runs are kept and go on.
"""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from dreamdrive.cli import parse_actions
from dreamdrive.data.photo import read_photo
from dreamdrive.data.pictures.images import read_image
from dreamdrive.errors import InputError
from dreamdrive.evaluate import VideoSettings, evaluate_video
from dreamdrive.generate import generate
from dreamdrive.options import QUALITIES
from dreamdrive.scene.control import Control
from dreamdrive.show import grid as side_by_side, write_png
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.markdown import grid
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.wild.figures import Picture, figures_of
from dreamdrive_bench.wild.places import Place, photos_of, read_places

_SIZE = (480, 270)


def main() -> int:
    """Make the scenes, measure, print the tables and write all as JSON."""
    parser = parser_of(__doc__, runs="runs/wild", markdown=True)
    parser.add_argument("manifest", type=Path)
    parser.add_argument("--priors", nargs="+", default=["photo"])
    parser.add_argument("--quality", default="draft")
    args = parser.parse_args()
    places = photos_of(args.manifest) if args.manifest.is_dir() else read_places(args.manifest)
    rows: list[dict[str, Any]] = []
    for prior in args.priors:
        for place, path in places:
            rows.append({"place": place.name, "asked": prior, **_made(place, path, prior, args)})
            print(place.name, prior, {k: rows[-1].get(k) for k in ("seconds", "psnr", "said")}, flush=True)
    distances = {prior: _distances(args.runs, prior, places) for prior in args.priors}
    report = {"machine": describe_machine(), "rows": rows, "distances": distances}
    return publish(args, report, _tables(rows, distances), ())


def _made(place: Place, path: Path, prior: str, args: Any) -> dict[str, Any]:
    """Figures of one place; what the program said where it made no scene."""
    out = args.runs / prior / place.name
    control = Control(path=path, view=place.view, hfov_deg=place.hfov_deg, **parse_actions(place.actions))
    options = QUALITIES[args.quality]
    geometry = replace(options.geometry, camera_height_m=place.camera_height_m)
    options = replace(options, geometry=geometry)
    try:
        generate(control, out, prior=None if prior == "auto" else prior, options=options, force=True)
    except InputError as error:
        return {"said": str(error)}
    row, pictures = figures_of(out)
    photo = read_photo(path, _SIZE, None, place.hfov_deg, place.view).rgb
    _keep(args.runs, prior, place.name, photo, pictures)
    return row


def _keep(runs: Path, prior: str, name: str, photo: Picture, pictures: list[Picture]) -> None:
    """A strip of the grid, and the pictures for the distances."""
    titles = ("photo", "begins", "middle", "end", "1 m aside")
    shown = [cv2.resize(each, _SIZE, interpolation=cv2.INTER_AREA) for each in (photo, *pictures)]
    strip = side_by_side(dict(zip(titles, shown, strict=True)), columns=len(shown))
    for folder, picture in (
        (runs / f"strips-{prior}", strip),
        (runs / "photos/all", shown[0]),
        (runs / f"drives-{prior}/all", shown[2]),
    ):
        folder.mkdir(parents=True, exist_ok=True)
        write_png(folder / f"{name}.png", picture)


def _distances(runs: Path, prior: str, places: list[tuple[Place, Path]]) -> dict[str, Any]:
    """Frechet and other distances of the middles of the drives to the photos."""
    made = [place.name for place, _ in places if (runs / f"drives-{prior}/all/{place.name}.png").is_file()]
    if len(made) < 2:
        return {}
    _write_grid(runs, prior, made)
    report = evaluate_video(runs / "photos", runs / f"drives-{prior}", VideoSettings(window=0))
    return {name: asdict(figure) for name, figure in report.distances.items()}


def _write_grid(runs: Path, prior: str, names: list[str]) -> None:
    strips = [read_image(runs / f"strips-{prior}/{name}.png").rgb[::2, ::2] for name in names]
    write_png(runs / f"grid-{prior}.png", np.concatenate(strips))


def _tables(rows: list[dict[str, Any]], distances: dict[str, Any]) -> str:
    head = ["place", "prior", "s", "PSNR", "uncovered 1 m aside", "moving IoU", "actors"]
    lines = [head]
    for row in rows:
        if "said" in row:
            lines.append([row["place"], row["asked"], "-", "-", "-", "-", row["said"]])
            continue
        iou = "-" if row["moving_iou"] is None else f"{row['moving_iou']:.2f}"
        cells = [f"{row['seconds']:.0f}", f"{row['psnr']:.1f}", f"{100 * row['uncovered_aside']:.1f} %", iou]
        lines.append([row["place"], row["prior"]["name"], *cells, str(row["actors"])])
    return f"{grid(lines)}\n\nDistances to the photos: {distances}\n"
