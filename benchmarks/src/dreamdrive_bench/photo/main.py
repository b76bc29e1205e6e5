"""What one photo tells of the street: what is seen later and from aside, how far off road and metres are.

Streets of edition 2, of which one picture and the camera's height are known; frames of the moving part of
PandaSet, with its calibration; two motorways, with cameras that the whole clip tells. From one frame the
frames 0.5, 1 and 2 s later are told along the true path, and on drawn streets the views 1 m aside; PSNR, SSIM
and perceptual distance (stlpips-vgg), beside the frozen frame, the homography of the road's plane, a road
plane before a backdrop, and the classical pop-up. The street network is the twin, which has seen none of
these clips.
"""

from collections import defaultdict
from collections.abc import Iterable
from typing import Any

import numpy as np
import torch

from dreamdrive.evaluate.networks import stlpips
from dreamdrive.splat import ssim
from dreamdrive.vision.pixels import psnr
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.markdown import grid
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.places import DATA
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.common.worlds import DEVELOPMENT, set_of
from dreamdrive_bench.photo.cases import Case, drawn, pandaset
from dreamdrive_bench.photo.highways import highways
from dreamdrive_bench.photo.shape import shape_of
from dreamdrive_bench.photo.ways import WAYS


def main() -> int:
    """Measure, print the tables and write all as JSON."""
    parser = parser_of(__doc__, markdown=True)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(DEVELOPMENT))
    parser.add_argument("--no-clips", action="store_true", help="drawn streets alone")
    args = parser.parse_args()
    distance = stlpips.load_stlpips("vgg")
    rows: list[dict[str, Any]] = []
    for case in cases(args.seeds, clips=not args.no_clips):
        rows.append(measured(case, distance))
        told = {name: sights["1 s"]["psnr"] for name, sights in rows[-1]["ways"].items()}
        print(case.name, {k: round(v, 2) for k, v in told.items()}, rows[-1].get("shape"), flush=True)
    report = {"machine": describe_machine(), "worlds": set_of(args.seeds), "rows": rows}
    return publish(args, report, tables(rows), ())


def cases(seeds: list[int], *, clips: bool) -> Iterable[Case]:
    """All that is measured."""
    yield from map(drawn, seeds)
    if clips and (DATA / "clips").is_dir():
        yield from pandaset()
        yield from highways()


def measured(case: Case, distance: Any) -> dict[str, Any]:
    """Figures of all ways for one picture."""
    ways: dict[str, dict[str, Any]] = {}
    for name, way in WAYS.items():
        found: dict[str, list[dict[str, float]]] = defaultdict(list)
        for sight in case.sights:
            said, true = (torch.from_numpy(x).float() / 255 for x in (way(case.start, sight), sight.rgb))
            planes = [(x * 2 - 1).permute(2, 0, 1)[None] for x in (said, true)]
            found[sight.name].append(
                {
                    "psnr": psnr(said, true),
                    "ssim": float(ssim(said, true)),
                    "stlpips": float(distance(*planes)[0]),
                }
            )
        ways[name] = {
            sight: {key: float(np.mean([each[key] for each in all_])) for key in all_[0]}
            for sight, all_ in found.items()
        }
    shape = {} if case.made is None else {"shape": shape_of(case.start, case.made)}
    return {"name": case.name, "ways": ways, **shape}


def tables(rows: list[dict[str, Any]]) -> str:
    """A table for drawn streets and one for each clip."""
    parts: list[str] = []
    for kind in dict.fromkeys(row["name"].split()[0] for row in rows):
        chosen = [row for row in rows if row["name"].startswith(kind)]
        sights = list(chosen[0]["ways"]["photo"])
        lines = [["way", *sights]]
        for way in WAYS:
            means = [
                [
                    np.mean([row["ways"][way][sight][key] for row in chosen])
                    for key in ("psnr", "ssim", "stlpips")
                ]
                for sight in sights
            ]
            lines.append([way, *(f"{a:.2f} / {b:.3f} / {c:.3f}" for a, b, c in means)])
        parts.append(f"## {kind}, {len(chosen)} pictures: PSNR / SSIM / stlpips-vgg\n\n{grid(lines)}")
    shapes = [row["shape"] for row in rows if "shape" in row]
    if shapes:
        road = np.array([each["road_rms_m"] for each in shapes])
        scale = np.array([each["scale"] for each in shapes])
        parts.append(
            f"Road within 20 m: {100 * np.sqrt((road**2).mean()):.1f} cm RMS, median street "
            f"{100 * np.median(road):.1f} cm. Metres within 15 % in "
            f"{100 * np.mean(np.abs(scale - 1) <= 0.15):.0f} % of streets."
        )
    return "\n\n".join(parts)
