"""How well trust in a view goes with its true error: drawn streets from aside, held-out frames of drives.

Spearman's correlation of what is expected with what is, over views and over blocks of 8x8 pixels, beside what
the distance from the recorded path tells alone, and among views of one distance; and how far aside PSNR falls
by 3 dB, as told and as it is. ``--calibrate`` fits the network that ships to the worlds of the development,
and judges each world by one that was fitted to the others.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import safetensors.numpy
from jaxtyping import Float
from scipy.stats import spearmanr

from dreamdrive.files.output import new_file
from dreamdrive.trust import CALIBRATED, SHIFTS_M, ErrorNetwork, error_network, fall_m
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.markdown import grid, number
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.report import publish
from dreamdrive_bench.common.twin import TWIN
from dreamdrive_bench.common.worlds import DEVELOPMENT, set_of
from dreamdrive_bench.drives.drive import drives
from dreamdrive_bench.trust.calibrate import calibrated
from dreamdrive_bench.trust.looks import Looks, of_drive, of_world, psnr_db

_LEAST_VIEWS = 12


def main() -> int:
    """Measure, print the tables and write all as JSON."""
    parser = parser_of(__doc__, runs="runs/trust", markdown=True)
    parser.add_argument("--seeds", type=int, nargs="*", default=list(DEVELOPMENT))
    parser.add_argument("--drives", nargs="*", default=None, metavar="NAME", help="without it all there are")
    parser.add_argument("--knowledge", default=TWIN)
    parser.add_argument("--calibrate", action="store_true")
    args = parser.parse_args()
    there = {name: drive for name, drive in drives().items() if drive.folder.exists()}
    names = sorted(there) if args.drives is None else args.drives
    streets = [of_world(seed, args.knowledge, args.runs) for seed in args.seeds]
    recorded = [of_drive(there[name], args.knowledge, args.runs) for name in names]
    networks = [error_network()] * len(streets)
    if args.calibrate:
        assert set_of(args.seeds) == "development"
        networks = [calibrated([s for s in streets if s is not street]) for street in streets]
        _ship(calibrated(streets))
    worlds = judged(streets, networks)
    on_drives = judged(recorded, [error_network()] * len(recorded))
    reach = [row for street, network in zip(streets, networks, strict=True) for row in falls(street, network)]
    off = [abs(row["told_m"] - row["is_m"]) / row["is_m"] for row in reach]
    report = {
        "machine": describe_machine(),
        "worlds": {"set": set_of(args.seeds), "seeds": args.seeds, **worlds},
        "drives": {"names": names, **on_drives},
        "fall": {"median_relative_error": float(np.median(off)) if off else None, "rows": reach},
    }
    rows = [["", "views", "by distance", "blocks", "by distance"]]
    for name, found in (("drawn streets", worlds), ("held-out frames", on_drives)):
        cells = (found[key] for key in ("views", "views_by_distance", "blocks", "blocks_by_distance"))
        rows.append([name, *(number(cell, ".3f") for cell in cells)])
    text = grid(rows) + f"\n\nOf one distance: {worlds['of_one_distance']}\nFall: {report['fall']}"
    return publish(args, report, text, ())


def judged(looks: Sequence[Looks], networks: Sequence[ErrorNetwork]) -> dict[str, Any]:
    """Correlations over all views but those that a fit has seen."""
    told, true, away, told_blocks, true_blocks, away_blocks = ([] for _ in range(6))
    for each, network in zip(looks, networks, strict=True):
        counts = each.novel
        expected = expected_of(each, network)[counts]
        off, away_m = each.squared_error[counts], each.away_m[counts]
        told.append(psnr_db(expected))
        true.append(psnr_db(off))
        away.append(away_m)
        told_blocks.append(expected.ravel())
        true_blocks.append(off.ravel())
        away_blocks.append(np.repeat(away_m, off[0].size))
    if not told:
        return dict.fromkeys(
            ("views", "views_by_distance", "blocks", "blocks_by_distance", "of_one_distance")
        )
    t, y, d = (np.concatenate(part) for part in (told, true, away))
    tb, yb, db = (np.concatenate(part) for part in (told_blocks, true_blocks, away_blocks))
    return {
        "count": len(y),
        "views": rank(t, y),
        "views_by_distance": rank(-d, y),
        "blocks": rank(tb, yb),
        "blocks_by_distance": rank(db, yb),
        "of_one_distance": {
            f"{m:g} m": rank(t[d == m], y[d == m]) for m in np.unique(d) if (d == m).sum() >= _LEAST_VIEWS
        },
        "bias_db": float((t - y).mean()),
    }


def expected_of(looks: Looks, network: ErrorNetwork) -> Float[np.ndarray, "v bh bw"]:
    """The squared error to expect, as ``SceneTrust.view`` tells it."""
    return network.squared_error(looks.features) * np.exp(looks.off)[:, None, None]


def rank(told: Float[np.ndarray, " n"], true: Float[np.ndarray, " n"]) -> float | None:
    """Spearman's correlation; None where one of them is constant."""
    if len(told) < 2 or np.ptp(told) == 0 or np.ptp(true) == 0:
        return None
    return float(spearmanr(told, true).statistic)


def falls(looks: Looks, network: ErrorNetwork) -> list[dict[str, Any]]:
    """How far to each side the mean PSNR is ``trust.reach.FALL_DB`` below that of the path, told and true."""
    told, true = psnr_db(expected_of(looks, network)), psnr_db(looks.squared_error)
    rows: list[dict[str, Any]] = []
    for side in (-1, 1):
        seen = [np.isclose(looks.shift_m, side * metres) for metres in SHIFTS_M]
        frames = set(looks.frame[looks.away_m > 0].tolist())
        path = (looks.shift_m == 0) & np.isin(looks.frame, sorted(frames))
        there = [(0.0, path), *((m, s) for m, s in zip(SHIFTS_M, seen, strict=True) if s.any())]
        metres = [m for m, _ in there]
        ends = [fall_m(metres, [float(values[s].mean()) for _, s in there]) for values in (told, true)]
        if None not in ends:
            rows.append({"side": side, "told_m": ends[0], "is_m": ends[1]})
    return rows


def _ship(network: ErrorNetwork) -> None:
    with new_file(CALIBRATED) as partial:
        partial.write_bytes(safetensors.numpy.save(dict(vars(network))))
    error_network.cache_clear()
