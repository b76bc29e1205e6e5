"""How well what a photo does not show is filled: by the network of the prior photo, and by a library.

Streets of edition 2 at one moment, in layers with their true depth, so that only the filling differs: what is
seen some metres ahead and aside, with the frame before that the network is told of. And frames of PandaSet
1 s later along its true path, with the depth that the street network sees. In the truth what had to be filled
is replaced by what each way makes of it; such a picture against the truth: PSNR in those pixels, stlpips-vgg,
and the Frechet distance of squares around them in features of stlpips-alex. No training used either network.
Behind the two ways stands what no filling at all gives.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import torch

from dreamdrive.evaluate import frechet_distance
from dreamdrive.evaluate.networks import stlpips
from dreamdrive.prior.photo import load_photo_network
from dreamdrive.vision.pixels import psnr
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.markdown import grid
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.places import DATA
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.common.worlds import DEVELOPMENT, set_of
from dreamdrive_bench.photo.filled import WAYS, Filled, drawn_ones, recorded_ones
from dreamdrive_bench.photo.squares import features_of, squares_of


def main() -> int:
    """Measure, print the tables and write all as JSON."""
    parser = parser_of(__doc__, markdown=True)
    parser.add_argument("weights", type=Path)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(DEVELOPMENT))
    parser.add_argument("--no-clips", action="store_true", help="drawn streets alone")
    args = parser.parse_args()
    rows: list[dict[str, Any]] = []
    squares: dict[tuple[str, str], list[np.ndarray]] = {}
    distance = stlpips.load_stlpips("vgg")
    for filled in _filled(args):
        rows.append(_measured(filled, distance))
        print(filled.name, {k: rows[-1][k]["psnr"].__round__(2) for k in WAYS}, flush=True)
        kind = filled.name.split()[0]
        for way, picture in (("truth", filled.truth), *filled.pasted.items()):
            squares.setdefault((kind, way), []).extend(squares_of(picture, filled.region))
    distances = _distances(squares)
    report = {
        "machine": describe_machine(),
        "worlds": set_of(args.seeds),
        "rows": rows,
        "distances": distances,
    }
    return publish(args, report, _tables(rows, distances), ())


def _filled(args: Any) -> Iterable[Filled]:
    network = load_photo_network(args.weights)
    for seed in args.seeds:
        yield from drawn_ones(seed, network)
    if not args.no_clips and (DATA / "clips").is_dir():
        yield from recorded_ones(network)


def _measured(filled: Filled, distance: Any) -> dict[str, Any]:
    true = torch.from_numpy(filled.truth).float() / 255
    region = torch.from_numpy(filled.region)
    row: dict[str, Any] = {"name": filled.name, "share": float(filled.region.mean())}
    for way, picture in filled.pasted.items():
        said = torch.from_numpy(picture).float() / 255
        planes = [(x * 2 - 1).permute(2, 0, 1)[None] for x in (said, true)]
        row[way] = {
            "psnr": psnr(said[region], true[region]),
            "stlpips": float(distance(*planes)[0]),
        }
    return row


def _distances(squares: dict[tuple[str, str], list[np.ndarray]]) -> dict[str, dict[str, Any]]:
    """Frechet distances of each way's squares to those of the truth, and how many these are."""
    features = {key: features_of(each) for key, each in squares.items()}
    kinds = dict.fromkeys(kind for kind, _ in squares)
    return {
        kind: {
            "squares": len(squares[kind, "truth"]),
            **{way: frechet_distance(features[kind, "truth"], features[kind, way]) for way in WAYS},
        }
        for kind in kinds
    }


def _tables(rows: list[dict[str, Any]], distances: dict[str, dict[str, Any]]) -> str:
    lines = [["pictures", "way", "PSNR there", "stlpips-vgg", "Frechet distance, stlpips-alex"]]
    for kind, found in distances.items():
        chosen = [row for row in rows if row["name"].startswith(kind)]
        for way in WAYS:
            means = [np.mean([row[way][key] for row in chosen]) for key in ("psnr", "stlpips")]
            lines.append(
                [f"{kind}, {len(chosen)}", way, f"{means[0]:.2f}", f"{means[1]:.4f}", f"{found[way]:.3f}"]
            )
    return grid(lines)
