"""The paper's Table I on recorded drives: representations of motion by the distance of their novel views.

For each scene of a data set ``generate`` makes a scene of Gaussians per representation. All of a scene share
frames, looks, geometry, seeds and static fit, and take the same steps. Each is rendered along the novel
trajectories at the recorded times, at the size of the clip, as PNG. ``shift`` stands for two of them,
``--shift-m`` to the left and to the right; underscores may stand for hyphens. ``hybrid-standing`` is hybrid
whose street always stands, as the paper's does; that of hybrid drifts where single frames explain it better.

What is compared: the real set is the recorded pictures of the first camera, those of ``--frames``, brought to
the size of the clip, held-out ones too. The fake set is the renders of one representation, all novel
trajectories together: as many pictures for each trajectory as there are real ones. Of both come features of
every picture (FID, with ``--inception``) and of windows of ``--window`` pictures, one every ``--stride``
(FVD, with ``--i3d``), pooled over scenes. There is no true picture of a shifted view: the distance asks
whether the views look recorded, not whether they are right. Without the two files other networks stand in
for them. Their figures rank rows of one table and cannot be compared with publications.

Beside them: the same of the recorded path itself, where nothing is novel; the floor, which is the distance
of two random halves of the real pictures, ten times, and the distance of a half of the real pictures to a
half of the renders of one trajectory, which alone is comparable with it; kernel distances, which depend less
on how many pictures there are; with ``--hold-out`` PSNR and SSIM of withheld frames, where there is a truth.
The paper states neither how many pictures it took nor their size, nor its trajectories.

Priors that look at a picture get the first recorded one; those that are conditioned on a map get the scene.
Recorded pictures of ``--frames`` are the reference all the same. Layout priors count the frames they make by
``--frames``, too; the others make as many as they do.

What is finished in ``--runs`` is taken where it follows from the same input, options, program and networks.
A scene that cannot be made is named at the end; the table is over the scenes that all rows have.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from dreamdrive.errors import InputError
from dreamdrive.evaluate import Toolbox, WeightFiles, open_toolbox
from dreamdrive.options import QUALITIES
from dreamdrive.run import program_digest
from dreamdrive.scene.control import Control
from dreamdrive_bench.common.keep import Features
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.options import parser_of, size_of
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.table1.case import ROWS, Case, scene_names
from dreamdrive_bench.table1.drives import RECORDED, chosen, kept_real, rendered
from dreamdrive_bench.table1.measure import Ruler, row_of
from dreamdrive_bench.table1.scenes import made
from dreamdrive_bench.table1.tables import IMAGE, VIDEO, network_of, tables

LEAST_WINDOW = 9
"""Pictures that I3D needs."""


@dataclass(frozen=True)
class Measured:
    """What is known of a scene in one representation."""

    real: Features
    fake: dict[str, Features]
    record: dict[str, Any]


def options_of() -> argparse.ArgumentParser:
    """The command line."""
    parser = parser_of(__doc__, runs="runs/table1", markdown=True)
    add = parser.add_argument
    add("dataset", type=Path, metavar="DATASET", help="folder of a data set with scenes")
    add("--scenes", nargs="+", default=["0"], metavar="N", help="names or numbers, or all (default: 0)")
    add("--cameras", metavar="NAMES", help="see dreamdrive generate; the first one is rendered")
    add("--frames", metavar="A:B:C", help="which of its pictures")
    add("--size", type=size_of, metavar="WxH", help="of the clip (default: 480 wide)")
    add("--hold-out", type=int, metavar="N", help="withhold every N-th picture")
    add("--prior", default="replay", metavar="NAME", help="what makes the frames (default: the recording)")
    add("--weights", metavar="W", help="of the prior")
    add("--representations", nargs="+", choices=ROWS, default=ROWS, metavar="NAME")
    add("--trajectories", nargs="+", default=["shift", "lane-left"], metavar="NAME")
    add("--shift-m", type=float, default=2.0, metavar="M", help="of shift, to either side")
    add("--inception", type=Path, metavar="FILE", help="weights of FID")
    add("--i3d", type=Path, metavar="FILE", help="weights of FVD")
    add("--window", type=int, default=16, metavar="N", help="pictures of a window")
    add("--stride", type=int, default=2, metavar="N", help="pictures from one window to the next")
    add("--resamples", type=int, default=200, metavar="N", help="of the scenes, behind intervals")
    add("--quality", choices=QUALITIES, default="draft")
    add("--device", metavar="cpu|cuda|cuda:N", default="cpu")
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Make, measure, print the tables and write them; the exit code."""
    parser = options_of()
    args = parser.parse_args(arguments)
    try:
        cases, names, ruler = _asked(args)
        found, failed = _measured(cases, names, ruler, args)
        report = report_of(found, names, ruler, args) | {"failed": failed}
    except InputError as error:
        parser.error(str(error))
    return publish(args, report, tables(report), failed)


def _asked(args: argparse.Namespace) -> tuple[list[Case], list[str], Ruler]:
    """Scenes, novel trajectories and networks; what cannot be had is said before anything is made."""
    names = chosen(args.trajectories)
    check_numbers(args)
    options = replace(QUALITIES[args.quality], device=args.device)
    about = {"cameras": args.cameras, "frames": args.frames, "hold_out": args.hold_out, "size": args.size}
    cases = [
        Case(Control(path=args.dataset, scene=name, **about), args.prior, args.weights, options)
        for name in scene_names(args.dataset, args.scenes)
    ]
    cases[0].request(args.representations[0])
    return cases, names, Ruler(toolbox_of(args.inception, args.i3d), args.window, args.stride)


def check_numbers(args: argparse.Namespace) -> None:
    """Refuse numbers that nothing can be measured with."""
    if args.i3d is not None and args.window < LEAST_WINDOW:
        raise InputError(f"--window {args.window}: FVD needs {LEAST_WINDOW} pictures or more")
    for flag, value, least in (("window", args.window, 1), ("stride", args.stride, 1)):
        if value < least:
            raise InputError(f"--{flag} {value}: expected {least} or more")
    if args.resamples < 0:
        raise InputError(f"--resamples {args.resamples}: expected 0 or more")
    if not np.isfinite(args.shift_m) or args.shift_m <= 0:
        raise InputError(f"--shift-m {args.shift_m:g}: expected metres above 0; both sides are taken")


def toolbox_of(inception: Path | None, i3d: Path | None) -> Toolbox:
    """The networks: those whose files are given, and stand-ins."""
    for flag, file in (("inception", inception), ("i3d", i3d)):
        if file is not None and not file.is_file():
            raise InputError(f"--{flag} {file}: no such file")
    toolbox = open_toolbox(WeightFiles(inception=inception, i3d=i3d))
    there = [each.frechet for each in toolbox.extractors]
    for choices in (IMAGE, VIDEO):
        if network_of(choices, there) is None:
            missing = "; ".join(f"{name}: {why}" for name, why in toolbox.missing.items())
            raise InputError(f"no network for {choices[0].called}, and none that stands in for it: {missing}")
    return toolbox


def _measured(
    cases: Sequence[Case], names: Sequence[str], ruler: Ruler, args: argparse.Namespace
) -> tuple[dict[str, dict[str, Measured]], list[str]]:
    """By representation and scene what was measured; and what failed, and why."""
    found: dict[str, dict[str, Measured]] = {name: {} for name in args.representations}
    failed: list[str] = []
    for case in cases:
        for representation in args.representations:
            try:
                one = measure(case, representation, names, ruler, args)
            except InputError as error:
                failed.append(f"{case.name}, {representation}: {error}")
                continue
            found[representation][case.name] = one
            print(f"{case.name} {representation}: {one.record['held_out'] or 'made'}", flush=True)
    return found, failed


def measure(
    case: Case,
    representation: str,
    names: Sequence[str],
    ruler: Ruler,
    args: argparse.Namespace,
) -> Measured:
    """Make a scene, render its drives and take the features of all pictures; each is kept."""
    runs = args.runs
    scene = made(case, representation, runs)
    record = scene.record | {"drifts": scene.load().moves_per_frame}
    width, height = record["size"]
    real = kept_real(case.real((width, height)), runs / "real" / case.name)
    features = runs / "features"
    fake: dict[str, Features] = {}
    for name in (*names, RECORDED):
        pictures = rendered(scene, representation, name, args.shift_m, runs)
        file = features / representation / f"{case.name}-{name}.json"
        fake[name] = ruler.features(pictures, file)
    return Measured(ruler.features(real, features / "real" / f"{case.name}.json"), fake, record)


def report_of(
    found: dict[str, dict[str, Measured]], novel: Sequence[str], ruler: Ruler, args: argparse.Namespace
) -> dict[str, Any]:
    """All figures, over the scenes that all representations have."""
    common = [name for name in next(iter(found.values())) if all(name in each for each in found.values())]
    rows: dict[str, Any] = {}
    for name, scenes in found.items() if common else ():
        chosen_scenes = [scenes[each] for each in common]
        drives = {drive: [each.fake[drive] for each in chosen_scenes] for drive in (*novel, RECORDED)}
        real = [each.real for each in chosen_scenes]
        row = row_of(real, drives, novel, ruler.toolbox, args.resamples)
        records = [each.record for each in chosen_scenes]
        drifting = sum(each["drifts"] for each in records)
        rows[name] = row | {"held_out": held_out(records), "drifting": drifting}
    made_of = {rep: {name: one.record for name, one in each.items()} for rep, each in found.items()}
    sizes = [each["size"] for scenes in made_of.values() for each in scenes.values()]
    networks = {each.frechet: ruler.toolbox.weights[each.frechet] for each in ruler.toolbox.extractors}
    return {
        "machine": describe_machine(),
        "program": program_digest(),
        "dataset": args.dataset.name,
        "scenes": common,
        "asked": asked(args, novel),
        "size": sizes[0] if sizes else None,
        "recorded_path": RECORDED,
        "weights": networks,
        "rows": rows,
        "made": made_of,
    }


def asked(args: argparse.Namespace, novel: Sequence[str]) -> dict[str, Any]:
    """The options that figures follow from."""
    names = (
        "cameras",
        "frames",
        "size",
        "hold_out",
        "prior",
        "quality",
        "shift_m",
        "window",
        "stride",
    )
    chosen_options = {name: getattr(args, name) for name in names}
    weights = None if args.weights is None else Path(args.weights).name
    return {**chosen_options, "weights": weights, "resamples": args.resamples, "trajectories": list(novel)}


def held_out(records: Sequence[dict[str, Any]]) -> dict[str, float] | None:
    """Means over the withheld frames of all scenes; None where none were."""
    with_some = [each for each in records if each["held_out"] is not None]
    if not with_some:
        return None
    counts = np.array([each["held_out_frames"] for each in with_some])
    means = {
        name: float(np.average([each["held_out"][name] for each in with_some], weights=counts))
        for name in ("psnr", "ssim")
    }
    return {**means, "frames": int(counts.sum())}
