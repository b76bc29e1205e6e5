"""Does a scene follow its layout? One box moved by 2 m, or the road's edge by 0.5 m, and all else the same.

    python benchmarks/control.py [--quick] [--seeds S ...] [--runs runs/control] [--json FILE]

Every seed gives a street; it is generated once as drawn and once for each change, with the same seed. For a
moving vehicle (one that the first scene finds, if any) and for a parked one its Gaussians in the first
scene (the dynamic ones that show it, or, parked, all that do) are moved along the change until the first
scene looks most like the second; that nothing else tells where it is now, so that a scene in which it has
not moved gives 0 m, and one in which it is not there nothing. For the road's edge (straight streets: seeds
that 3 divides) it is the edge at which a clean drawing of the world is most like the changed scene. PSNR
compares the renders of both scenes where the change is not: outside the vehicle's masks in both worlds and
whatever else differs between the worlds' clean frames (shadows, the strip beside the edge), widened by 8
px. --geometry true hands exact poses and depth over.
"""

import argparse
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import torch
from _layout_edits import move_box, widen_road
from _markdown import columns
from _report_file import write
from _street_measure import to_scene

from dreamdrive.cli.machine import use_all_cores
from dreamdrive.data.layout_file import write_layout
from dreamdrive.evaluate.actor_places import gaussians_of, offset_m
from dreamdrive.evaluate.truth import Truth, views_of
from dreamdrive.pipeline import generate
from dreamdrive.scene.camera import Camera
from dreamdrive.scene.control import Control
from dreamdrive.scene.folder import load_scene
from dreamdrive.scene.gaussians import Gaussians
from dreamdrive.scene.layout import Layout
from dreamdrive.scene.scene import Scene
from dreamdrive.scene.similarity import Similarity, fit_similarity
from dreamdrive.splat import one_torch_thread
from dreamdrive.splat import render as splat
from dreamdrive.splat.scene_view import render_scene
from dreamdrive.world import Drive, StreetOptions, draw_street, drive

ROOT = Path(__file__).resolve().parents[1]
FPS = 10.0
MOVE_M, EDGE_M = 2.0, 0.5
RIM_PX = 8
DIFFERENT = 2  # grey levels between clean frames from which on a pixel counts as changed
EDGES_M = np.arange(-0.25, 1.001, 0.125)
SHIFTS_M = np.arange(-1.5, 4.001, 0.25)
LOOKS = 6  # frames that a shift is found in
LIKE = 0.5  # squared error at the shift found over the greatest of all, from which on nothing is found


@dataclass(frozen=True)
class Made:
    """A street with its scene."""

    drive: Drive
    truth: Truth
    scene: Scene
    views: tuple[Camera, ...]


@dataclass(frozen=True)
class Row:
    """What one change does.

    Attributes:
        seed: The street, and the seed of everything random.
        change: ``moving``, ``parked`` or ``edge``.
        what: The box and the way it goes.
        wanted_m: How far it was moved.
        shift_m: How far the scene moved it, in the scene's own metres; None where that is not found.
        aligned_m: The same with both scenes brought onto the truth by their cameras.
        frames: Number of frames in which it was looked for, or that were compared.
        psnr: Between the renders of both scenes, where the change is not.
        kept: Share of the pixels that this is.
        worlds_psnr: The same between the worlds' clean frames.
    """

    seed: int
    change: str
    what: str
    wanted_m: float
    shift_m: float | None
    aligned_m: float | None
    frames: int
    psnr: float
    kept: float
    worlds_psnr: float


def main() -> None:
    """Generate, measure, print one table and write it as JSON."""
    options = arguments()
    use_all_cores()
    rows: list[Row] = []
    for seed in options.seeds:
        found = measure(seed, options)
        rows += found
        print(table(found), flush=True)
        settings = {k: str(v) if isinstance(v, Path) else v for k, v in vars(options).items() if k != "json"}
        text = json.dumps({"settings": settings, "rows": [asdict(row) for row in rows]}, indent=1)
        write(options.json, text + "\n")


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="one street, 12 frames of 160x96")
    parser.add_argument("--seeds", type=int, nargs="+")
    parser.add_argument("--frames", type=int)
    parser.add_argument("--size", type=int, nargs=2, metavar=("W", "H"))
    parser.add_argument("--quality", default="draft")
    parser.add_argument("--geometry", choices=("estimated", "true"), default="estimated")
    parser.add_argument("--runs", type=Path, default=ROOT / "runs" / "control")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    options.seeds = options.seeds or ([3] if options.quick else [0, 3, 5])
    options.frames = options.frames or (12 if options.quick else 24)
    options.size = tuple(options.size or ((160, 96) if options.quick else (320, 192)))
    return options


def measure(seed: int, options: argparse.Namespace) -> list[Row]:
    """All changes of one street."""
    layout = draw_street(seed, StreetOptions(seconds=options.frames / FPS))
    before = make(layout, f"{seed}", seed, options)
    rows: list[Row] = []
    for change in ("moving", "parked"):
        edit = move_box(before.drive, change == "moving", MOVE_M, found_in(before))
        after = make(edit.layout, f"{seed}-{change}", seed, options)
        world_m = after.drive.world_from_map[:3, :2] @ edit.moved_m
        instance = next(box.instance for box in after.drive.boxes if box.id == edit.id)
        shifts = [
            shift(before, after, instance, world_m, change == "moving", brought)
            for brought in (lambda _: Similarity(1.0, np.eye(3), np.zeros(3)), aligned)
        ]
        what = f"{edit.id} {edit.way}"
        row = compare(before, after, instance)
        rows.append(Row(seed, change, what, MOVE_M, shifts[0][0], shifts[1][0], shifts[0][1], *row))
    if seed % 3 == 0:
        wide = make(widen_road(layout, EDGE_M), f"{seed}-edge", seed, options)
        edges = edge_of(wide, layout), edge_of(before, layout)
        moved = None if None in edges else edges[0] - edges[1]
        row = compare(before, wide, None)
        rows.append(Row(seed, "edge", "right edge out", EDGE_M, moved, None, len(wide.views), *row))
    return rows


def make(layout: Layout, name: str, seed: int, options: argparse.Namespace) -> Made:
    """Draw a street and generate its scene, unless it is there already."""
    seen = drive(layout, options.frames, FPS, options.size)
    folder = options.runs / f"{options.geometry}-{options.size[0]}-{options.frames}-{options.quality}" / name
    folder.mkdir(parents=True, exist_ok=True)
    write_layout(layout, folder / "layout.json")
    given = write_geometry(seen, folder / "geometry") if options.geometry == "true" else None
    control = Control(
        path=folder / "layout.json", frames=f"0:{options.frames}", fps=FPS, size=options.size, seed=seed
    )
    generate(
        control,
        folder / "out",
        prior="street-world",
        quality=options.quality,
        geometry_files=given,
        force=True,
    )
    scene, truth = load_scene(folder / "out" / "scene"), Truth.of(seen)
    return Made(seen, truth, scene, views_of(scene, truth))


def write_geometry(seen: Drive, folder: Path) -> Path:
    """Exact poses and depth as ``generate --geometry-files`` reads them."""
    (folder / "depth").mkdir(parents=True, exist_ok=True)
    camera = seen.cameras[0]
    intrinsics = {"fx": camera.fx_px, "fy": camera.fy_px, "cx": camera.cx_px - 0.5, "cy": camera.cy_px - 0.5}
    poses = seen.trajectory.world_from_camera.tolist()
    record = {"width": camera.width_px, "height": camera.height_px, "intrinsics": intrinsics}
    (folder / "cameras.json").write_text(json.dumps({**record, "world_from_camera": poses}))
    for i, depth_m in enumerate(seen.depth_m):
        np.savez(folder / "depth" / f"{i:04d}.npz", depth_m=depth_m)
    return folder


def aligned(made: Made) -> Similarity:
    """Brings a scene onto its truth."""
    return fit_similarity(made.views, made.truth.cameras)


def shift(
    before: Made,
    after: Made,
    instance: int,
    wanted_m: np.ndarray,
    dynamic: bool,
    brought: Callable[[Made], Similarity],
) -> tuple[float | None, int]:
    """How far a box went along the wanted way, and in how many frames it was looked for.

    Its Gaussians of the scene before are moved by each of ``SHIFTS_M``, and the picture is compared with that
    of the scene after wherever they come to lie at any of them. What they leave uncovered is not known and
    not compared. A parabola goes through the best shift and its neighbours.

    Returns:
        The shift in metres, and the number of frames. None where the scene before does not show the box; or
        where no shift makes its own pixels much more alike than the worst one does, as when it is not there;
        or where the best one is the first or the last.
    """
    along = wanted_m / np.linalg.norm(wanted_m)
    far, own, looks = np.zeros(len(SHIFTS_M)), np.zeros((len(SHIFTS_M), 2)), 0
    frames = range(0, len(before.views), max(1, len(before.views) // LOOKS))
    for frame in frames:
        found = _agreement(before, after, frame, instance, along, dynamic, brought)
        if found is not None:
            far, own, looks = far + found[0], own + found[1], looks + 1
    best = int(far.argmin())
    apart = own[:, 0] / np.maximum(own[:, 1], 1)
    if not looks or apart[best] >= LIKE * apart.max():
        return None, looks
    return lowest(SHIFTS_M, far), looks


def _agreement(
    before: Made,
    after: Made,
    frame: int,
    instance: int,
    along: np.ndarray,
    dynamic: bool,
    brought: Callable[[Made], Similarity],
) -> tuple[np.ndarray, np.ndarray] | None:
    """By shift the squared error where the box may be; and that of its own pixels, with their number."""
    scene, truth = before.scene, before.truth
    own = gaussians_of(scene, before.views[frame], truth, frame, instance, moving=dynamic)
    if own is None:
        return None
    here, there = brought(before), brought(after)
    camera = to_scene(_from_scene(after.views[frame], there), here)
    camera = before.views[frame].at(camera.world_from_camera)
    way = here.rotation.T @ along / here.scale
    shown = scene.at(float(scene.times_s[frame]))
    pictures, covers = zip(
        *(_moved_picture(scene, shown, own, m * way, camera) for m in SHIFTS_M), strict=True
    )
    target = render_scene(
        after.scene, after.views[frame], float(after.scene.times_s[frame]), exposure=False
    ).colour.numpy()
    cover = np.stack(covers)
    at_rest = cover[int(np.abs(SHIFTS_M).argmin())]
    squared = np.square(np.stack(pictures) - target).mean(axis=-1)
    known = cover.any(axis=0) & (cover | ~at_rest)
    far = np.where(known, squared, 0).sum(axis=(1, 2))
    return far, np.stack([(squared * cover).sum(axis=(1, 2)), cover.sum(axis=(1, 2))], axis=1)


def _from_scene(camera: Camera, truth_from_scene: Similarity) -> Camera:
    """A camera of a scene in the world of the truth."""
    pose = np.eye(4)
    pose[:3, :3] = truth_from_scene.rotation @ camera.world_from_camera[:3, :3]
    pose[:3, 3] = truth_from_scene(camera.world_from_camera[:3, 3])
    return camera.at(pose)


@one_torch_thread()
@torch.no_grad()
def _moved_picture(
    scene: Scene, shown: Gaussians, own: np.ndarray, way_m: np.ndarray, camera: Camera
) -> tuple[np.ndarray, np.ndarray]:
    """A scene with some of its Gaussians moved (H, W, 3), and the pixels that they fill (H, W)."""
    chosen = torch.from_numpy(own)
    means = shown.means + chosen[:, None] * torch.from_numpy(way_m).to(shown.means.dtype)
    drawn = splat(replace(shown, means=means), camera, channels=chosen[:, None].to(means.dtype))
    colour = drawn.colour
    if scene.sky is not None:
        colour = colour + (1 - drawn.alpha)[..., None] * scene.sky.colour(camera)
    return colour.clamp(0, 1).numpy(), drawn.channels[..., 0].numpy() >= 0.5


def found_in(made: Made) -> set[str]:
    """Names of the moving boxes that dynamic Gaussians show in half of the frames or more."""
    scene, truth, brought = made.scene, made.truth, aligned(made)
    found: set[str] = set()
    for box in made.drive.boxes:
        places = [
            offset_m(scene, view, truth, frame, box.instance, brought)
            for frame, view in enumerate(made.views)
            if box.moving
        ]
        if sum(place is not None for place in places) > len(places) / 2:
            found.add(box.id)
    return found


def compare(before: Made, after: Made, instance: int | None) -> tuple[float, float, float]:
    """PSNR of the renders, share of the pixels that it is of, PSNR of the clean frames there."""
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * RIM_PX + 1, 2 * RIM_PX + 1))
    squared, clean, kept = 0.0, 0.0, 0
    for frame in range(len(before.views)):
        frames = [made.drive.frames[frame].astype(float) for made in (before, after)]
        changed = np.abs(frames[1] - frames[0]).max(axis=-1) >= DIFFERENT
        if instance is not None:
            changed |= (before.truth.instance[frame] == instance) | (after.truth.instance[frame] == instance)
        keep = cv2.dilate(changed.astype(np.uint8), disc) == 0
        images = [render(made, frame) for made in (before, after)]
        squared += float(np.square(images[1] - images[0])[keep].sum())
        clean += float(np.square((frames[1] - frames[0]) / 255)[keep].sum())
        kept += int(keep.sum())
    return psnr(squared, 3 * kept), kept / before.truth.moving.size, psnr(clean, 3 * kept)


def render(made: Made, frame: int) -> np.ndarray:
    """A frame of a scene (H, W, 3) in [0, 1]."""
    return render_scene(made.scene, made.views[frame], float(made.scene.times_s[frame])).colour.numpy()


def psnr(squared: float, count: int) -> float:
    """PSNR in dB from a sum of squares; at most 99."""
    return float(min(99.0, -10 * np.log10(max(squared, 1e-12) / count)))


def edge_of(made: Made, layout: Layout) -> float | None:
    """By how much the road of a layout has to be widened to look most like a scene, in metres.

    Every trial is a clean drawing; they are compared where any two of them differ, and a parabola goes
    through the best and its neighbours. None where the best is the first or the last.
    """
    count, size = len(made.views), made.truth.size
    chosen = range(0, count, max(1, count // 4))
    trials = np.stack([drive(widen_road(layout, float(m)), count, FPS, size).frames[chosen] for m in EDGES_M])
    differs = np.ptp(trials, axis=0).max(axis=-1) >= DIFFERENT
    shown = np.stack([render(made, frame) for frame in chosen])
    errors = np.array([np.square(trial / 255 - shown)[differs].mean() for trial in trials])
    return lowest(EDGES_M, errors)


def lowest(places: np.ndarray, errors: np.ndarray) -> float | None:
    """Where a parabola through the least error and its neighbours is lowest; None at either end."""
    best = int(errors.argmin())
    if best in (0, len(errors) - 1):
        return None
    a, b, c = errors[best - 1 : best + 2]
    step = float(places[1] - places[0])
    return float(places[best] + 0.5 * step * (a - c) / max(a - 2 * b + c, 1e-12))


def table(rows: list[Row]) -> str:
    """The rows for a terminal."""

    def metres(value: float | None) -> str:
        return "-" if value is None else f"{value:.2f}"

    head = ("change", "seed", "what", "wanted m", "shift m", "aligned m", "frames", "PSNR", "kept", "worlds")
    body = [
        (
            row.change,
            str(row.seed),
            row.what,
            metres(row.wanted_m),
            metres(row.shift_m),
            metres(row.aligned_m),
            str(row.frames),
            f"{row.psnr:.1f}",
            f"{100 * row.kept:.0f} %",
            f"{row.worlds_psnr:.1f}",
        )
        for row in rows
    ]
    return columns(head, body)


if __name__ == "__main__":
    main()
