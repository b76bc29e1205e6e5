"""What the paper and this project claim of hybrid, beside what the tables say."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

from dreamdrive_bench.common.markdown import number, span

VIDEO_NETWORKS = ("fvd", "frechet_transnetv2")
LEAST_GAIN_DB, MOST_LOSS_DB = 0.5, 0.1
IMAGE_RATIO, IMAGE_RATIO_TO_STATIC, VIDEO_RATIO = 0.85, 0.75, 0.9
MASK_IOU = {"true": 0.75, "estimated": 0.6}
FAKE_SHARE, CONSISTENCY_RATIO = 0.2, 0.5


@dataclass(frozen=True)
class Claim:
    """A figure that was asked for.

    Attributes:
        about: What.
        asked: In words.
        measured: In figures.
        holds: None where it is undecided.
    """

    about: str
    asked: str
    measured: str
    holds: bool | None


def claims(report: dict[str, Any]) -> list[dict[str, Any]]:
    """All claims that the tables of a report can tell about."""
    found: list[Claim] = []
    for table in report["tables"]:
        if table["budget"] == "equal_steps":
            found += [*_likeness(table), *_distances(table), *_decomposition(table)]
    for table in report.get("consistency", []):
        found.append(_consistency(table))
    found += _recording(report.get("recording") or [])
    return [asdict(claim) for claim in found]


def _name(table: dict[str, Any]) -> str:
    return f"{table['geometry']} geometry, {table['references']} references"


def _likeness(table: dict[str, Any]) -> Iterator[Claim]:
    gains = table["against_best_other"]
    if not gains:
        return
    if table["references"] == "corrupted":
        for view in ("held_out", "novel"):
            gain = gains[view]
            yield Claim(
                f"{_name(table)}: PSNR of {view} less the best other's",
                f"{LEAST_GAIN_DB} dB, interval above 0",
                f"{gain['db']:+.2f} dB{span(gain['low'], gain['high'], '+.2f')}",
                gain["db"] >= LEAST_GAIN_DB and gain["low"] > 0,
            )
    worst = min(gains, key=lambda view: gains[view]["db"])
    yield Claim(
        f"{_name(table)}: the worst view",
        f"not more than {MOST_LOSS_DB} dB below the best other",
        f"{gains[worst]['db']:+.2f} dB, {worst}",
        gains[worst]["db"] >= -MOST_LOSS_DB,
    )


def _distances(table: dict[str, Any]) -> Iterator[Claim]:
    if table["references"] != "corrupted":
        return
    for row in table["distances_compared"]:
        video = row["network"] in VIDEO_NETWORKS
        if not row["projected"] or (video and row["against"] == "static"):
            continue
        most = VIDEO_RATIO if video else IMAGE_RATIO_TO_STATIC if row["against"] == "static" else IMAGE_RATIO
        yield Claim(
            f"{_name(table)}: {row['network']}, excess over that of {row['against']}",
            f"at most {most}",
            "the other has no excess"
            if row["ours_over_this"] is None
            else number(row["ours_over_this"]) + span(row["ratio_low"], row["ratio_high"]),
            None if row["undecided"] else row["ours_over_this"] <= most,
        )


def _decomposition(table: dict[str, Any]) -> Iterator[Claim]:
    by = {row["representation"]: row for row in table["means"]}
    ours, other = by.get("hybrid"), by.get("deformable")
    if ours is None:
        return
    asked = MASK_IOU.get(table["geometry"])
    if table["references"] == "clean" and asked is not None and ours["mask_iou"] is not None:
        yield Claim(
            f"{_name(table)}: IoU of the moving mask",
            f"at least {asked}",
            f"{ours['mask_iou']:.2f}",
            ours["mask_iou"] >= asked,
        )
    if other is not None and ours["fake_m"] is not None and other["fake_m"]:
        yield Claim(
            f"{_name(table)}: fake motion",
            f"at most {FAKE_SHARE} of deformable's",
            f"{1000 * ours['fake_m']:.0f} mm of {1000 * other['fake_m']:.0f} mm",
            ours["fake_m"] <= FAKE_SHARE * other["fake_m"],
        )


def _consistency(table: dict[str, Any]) -> Claim:
    ratios = [row["ratio"] for row in table["rows"]]
    met = sum(ratio <= CONSISTENCY_RATIO for ratio in ratios)
    return Claim(
        f"{table['geometry']} geometry: errors of consistency over the references'",
        f"at most {CONSISTENCY_RATIO}",
        f"{met} of {len(ratios)}; {min(ratios):.2f} to {max(ratios):.2f}",
        met == len(ratios),
    )


def _recording(rows: list[dict[str, Any]]) -> Iterator[Claim]:
    by = {row["representation"]: row for row in rows}
    if "hybrid" not in by or len(by) < 2:
        return
    for figure, about in (("psnr", "PSNR of held-out frames"), ("moving_psnr", "the same inside hulls")):
        values = {name: row[figure] for name, row in by.items() if row[figure] is not None}
        best = max((name for name in values if name != "hybrid"), key=values.__getitem__)
        gain = values["hybrid"] - values[best]
        yield Claim(
            f"recorded clip: {about} less the best other's",
            f"{LEAST_GAIN_DB} dB",
            f"{gain:+.2f} dB, {best}",
            gain >= LEAST_GAIN_DB,
        )
