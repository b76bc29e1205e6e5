"""Structure from motion of a queue: a drawn street whose picture is three quarters traffic that moves.

The path of the recording car is found from the frames alone (``none``), from the frames and the true
outlines of all road users (``outlines``), or with the street network of a file of weights or a name that
ships. Outlines tell nothing of the lens. The lens is a guess, or with ``--calibrated`` the true one. Path
errors are after the best similarity, in per cent of the length; where structure from motion was refused they
are those of frame-to-frame odometry. Traffic is the share of all pixels in which a road user moves.

With ``--scenes`` a draft is made of each as well, with every eighth frame held out: how well these are shown
by a street that may drift and by one that may not, and by blending their neighbours along the flow.
"""

import argparse
import sys
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from functools import lru_cache

import numpy as np

from dreamdrive.build import Given, build_scene
from dreamdrive.files.digest import stage_seed
from dreamdrive.geometry import reconstruct
from dreamdrive.geometry.cameras import pose_clip
from dreamdrive.metrics.paths import compare_paths
from dreamdrive.options import QUALITIES
from dreamdrive.run import score_baselines, score_scene
from dreamdrive.scene.clip import Clip, Known
from dreamdrive.scene.street.truth import DriveTruth
from dreamdrive.street_network import NO_KNOWLEDGE, SHIPPED, look_at, with_looks
from dreamdrive_bench.common.drawn import drawn_clip
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.common.true_look import true_look
from dreamdrive_bench.common.twin import TWIN, name_of
from dreamdrive_bench.common.worlds import SETS
from streetworld import StreetOptions, draw_street, drive

FRAMES, RATE_HZ, SIZE, EDITION, HOLD_OUT = 24, 10.0, (480, 270), 2, 8
SEEDS = 8
"""Of each set, from its first on."""
OUTLINES = "outlines"
GOAL_PERCENT = 0.5


@dataclass(frozen=True)
class Row:
    """One street, with one knowledge of its road users.

    Attributes:
        seed: Of the street.
        knowledge: What is told of road users.
        traffic: Share of pixels of moving road users.
        path_m: Length of the true path.
        refused: Why structure from motion was not used; None where it was.
        path_percent: Root mean square distance of the positions over the length of the path.
        rotation_deg_per_m: Mean difference in heading over stretches of the path.
        focal_percent: By how much the focal length is too long.
        seconds: Seconds of finding the path, without those of the network.
        scene: PSNR of held-out frames in dB, of each way to show them; None where no scene was made.
    """

    seed: int
    knowledge: str
    traffic: float
    path_m: float
    refused: str | None
    path_percent: float
    rotation_deg_per_m: float
    focal_percent: float
    seconds: float
    scene: dict[str, float] | None = None

    @property
    def good(self) -> bool:
        """Whether structure from motion found the path."""
        return self.refused is None and self.path_percent <= GOAL_PERCENT


def main() -> int:
    """Measure each street, print the table, write both."""
    args = parse()
    rows: list[Row] = []
    for seed in args.seeds or SETS[args.worlds][:SEEDS]:
        for knowledge in args.knowledge:
            rows.append(measure(seed, knowledge, args.calibrated, args.scenes))
            print(rows[-1], file=sys.stderr, flush=True)
    report = {"machine": describe_machine(), "calibrated": args.calibrated, "rows": [asdict(r) for r in rows]}
    return publish(args, report, table(rows), [])


def parse() -> argparse.Namespace:
    """The command line."""
    parser = parser_of(__doc__, markdown=True)
    parser.add_argument("--worlds", choices=SETS, default="development", help="the first eight of a set")
    parser.add_argument("--seeds", type=int, nargs="+", metavar="S", help="others than those")
    parser.add_argument("--knowledge", nargs="+", default=[NO_KNOWLEDGE, TWIN, OUTLINES], metavar="WHAT")
    parser.add_argument("--scenes", action="store_true", help="make a scene of each, too")
    parser.add_argument("--calibrated", action="store_true", help="the lens is known")
    return parser.parse_args()


@lru_cache(1)
def queue_of(seed: int) -> DriveTruth:
    """The drive of a seed."""
    options = StreetOptions(FRAMES / RATE_HZ, edition=EDITION, traffic="queue")
    return drive(draw_street(seed, options), FRAMES, RATE_HZ, SIZE)


def told(made: DriveTruth, knowledge: str, calibrated: bool) -> Clip:
    """The frames of a drive, with what is known of its road users."""
    clip = drawn_clip(made, known=Known(intrinsics=calibrated))
    if knowledge == OUTLINES:
        return with_looks(clip, (true_look(made, clip.rig[0].fx_px),))
    return with_looks(clip, look_at(clip, knowledge))


def shown(clip: Clip, knowledge: str) -> dict[str, float]:
    """How well held-out frames of a clip are shown, in decibels."""
    held_out = np.arange(len(clip)) % HOLD_OUT == HOLD_OUT // 2
    clip = replace(clip, held_out=held_out)
    looks = None if clip.look is None else (clip.look,)
    options = replace(QUALITIES["draft"], knowledge=SHIPPED if knowledge == OUTLINES else knowledge)
    geometry = reconstruct(clip, options.geometry, seed=stage_seed(0, "geometry"))
    given, found = Given(geometry=geometry, looks=looks), dict[str, float]()
    for allowed in (True, False):
        drift = replace(options.drift, allowed=allowed)
        scene = build_scene(clip, replace(options, drift=drift), given=given).scene
        if allowed:
            found["drifts"] = float(scene.moves_per_frame)
        name = "may drift" if allowed else "may not"
        found[name] = float(np.mean([one.psnr for one in score_scene(clip, geometry, scene).values()]))
    blended = score_baselines(clip, geometry)["flow_interpolation"]
    return {**found, "blended": float(np.mean([one.psnr for one in blended.values()]))}


def measure(seed: int, knowledge: str, calibrated: bool, scenes: bool) -> Row:
    """Find the path of a street, and make a scene of it where that is asked for."""
    made = queue_of(seed)
    clip = told(made, knowledge, calibrated)
    began = time.perf_counter()
    posed = pose_clip(clip)
    seconds = time.perf_counter() - began
    found = np.stack([camera.world_from_camera for camera in posed.cameras])
    error = compare_paths(found, made.trajectory.world_from_camera)
    assert error is not None, "queues move"
    return Row(
        seed=seed,
        knowledge=name_of(knowledge),
        traffic=float(made.moving.mean()),
        path_m=made.trajectory.length_m,
        refused=posed.fallback,
        path_percent=error.ate_percent,
        rotation_deg_per_m=error.rotation_deg_per_m,
        focal_percent=100 * posed.cameras[0].fx_px / made.cameras[0].fx_px - 100,
        seconds=seconds,
        scene=shown(clip, knowledge) if scenes else None,
    )


def table(rows: Iterable[Row]) -> str:
    """A line a street and knowledge, and one a knowledge, in Markdown."""
    rows = list(rows)
    lines = [
        "| seed | knowledge | traffic | path m | path error % | heading deg/m | focal error % | s | |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    lines += [
        f"| {r.seed} | {r.knowledge} | {r.traffic:.2f} | {r.path_m:.1f} | {r.path_percent:.2f} | "
        f"{r.rotation_deg_per_m:.3f} | {r.focal_percent:+.1f} | {r.seconds:.0f} | {r.refused or ''} |"
        for r in rows
    ]
    for knowledge in dict.fromkeys(r.knowledge for r in rows):
        of = [r for r in rows if r.knowledge == knowledge]
        lines.append(
            f"\n{knowledge}: refused {sum(r.refused is not None for r in of)} of {len(of)}, found within "
            f"{GOAL_PERCENT} % {sum(r.good for r in of)}, median error "
            f"{np.median([r.path_percent for r in of]):.2f} %"
        )
    return "\n".join([*lines, *scene_table([r for r in rows if r.scene is not None])])


def scene_table(rows: list[Row]) -> list[str]:
    """Lines that tell how well held-out frames are shown; none without scenes."""
    if not rows:
        return []
    found = [(f"{r.seed} | {r.knowledge}", r.scene or {}) for r in rows]
    names = [name for name in found[0][1] if name != "drifts"]
    mean = {name: float(np.mean([scene[name] for _, scene in found])) for name in ("drifts", *names)}
    return [
        f"\n| seed | knowledge | drifts | {' | '.join(names)} |",
        "| --- " * (3 + len(names)) + "|",
        *(
            f"| {which} | {scene['drifts']:.2g} | {' | '.join(f'{scene[name]:.2f}' for name in names)} |"
            for which, scene in [*found, ("mean | ", mean)]
        ),
    ]
