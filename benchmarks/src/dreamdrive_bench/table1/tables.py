"""The table as Markdown: what was measured, by which networks, beside the paper's figures."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from dreamdrive_bench.common.markdown import NONE, span, table

Report = dict[str, Any]
PAPER = {
    "static": ("3D-GS", 82.12, 787.67),
    "deformable": ("Deformable Gaussians", 65.29, 450.43),
    "hexplane": ("Street Gaussians (S3)", 61.19, 456.56),
    "hybrid": ("DreamDrive", 45.59, 374.02),
    "hybrid-standing": ("DreamDrive", 45.59, 374.02),
}
"""Name, FID and FVD of Table I; vibration has no row there."""


@dataclass(frozen=True)
class Network:
    """A network that a column is measured by.

    Attributes:
        frechet: Name of its Fréchet distance.
        kernel: Name of its kernel distance.
        called: Head of its columns.
        about: The network in words.
        stands_for: The figure it stands in for; None where it is that figure.
    """

    frechet: str
    kernel: str
    called: str
    about: str
    stands_for: str | None


IMAGE = (
    Network("fid", "kid", "FID", "Inception v3", None),
    Network(
        "frechet_efficientnet_lite0",
        "kernel_efficientnet_lite0",
        "pictures (stand-in)",
        "EfficientNet-Lite0",
        "FID",
    ),
)
VIDEO = (
    Network("fvd", "kvd", "FVD", "I3D", None),
    Network("frechet_transnetv2", "kernel_transnetv2", "windows (stand-in)", "TransNetV2", "FVD"),
)
"""Networks by preference; the first that is there makes the columns."""


def network_of(choices: Sequence[Network], there: Sequence[str]) -> Network | None:
    """The first whose distance is there."""
    return next((each for each in choices if each.frechet in there), None)


def shown_networks(report: Report) -> list[Network]:
    """The networks that the columns are of."""
    there = list(report["weights"])
    found = (network_of(choices, there) for choices in (IMAGE, VIDEO))
    return [each for each in found if each is not None]


def tables(report: Report) -> str:
    """What was compared, and all tables."""
    if not report["rows"]:
        return "No scene has all rows.\n"
    networks = shown_networks(report)
    parts = [_compared(report, networks), _main(report, networks)]
    parts += [_alone(report, network) for network in networks]
    return "\n\n".join(parts) + "\n"


def _compared(report: Report, networks: Sequence[Network]) -> str:
    asked, first = report["asked"], next(iter(report["rows"].values()))
    counts = " and ".join(
        f"{first['novel'][n.frechet]['real_samples']} real and {first['novel'][n.frechet]['fake_samples']} "
        f"rendered {what}"
        for n, what in zip(networks, ("pictures", f"windows of {asked['window']}"), strict=True)
    )
    width, height = report["size"]
    scenes = report["scenes"]
    of = f"the scene {scenes[0]}" if len(scenes) == 1 else f"{len(scenes)} scenes"
    lines = [
        f"Of {report['dataset']} {of}, prior {asked['prior']}, {asked['quality']}, {width}x{height}. Each "
        f"row compares {counts}, one every {asked['stride']}; novel trajectories are "
        f"{', '.join(asked['trajectories'])}; a shift is {asked['shift_m']:g} m.",
        *(_said_of(network, report["weights"][network.frechet]["file"]) for network in networks),
    ]
    return " ".join(lines)


def _said_of(network: Network, file: str) -> str:
    if network.stands_for is None:
        return f"{network.called} is by {network.about} ({file})."
    return (
        f"{network.about} ({file}) is a stand-in for {network.stands_for}'s network: its figures cannot be "
        "compared with those of any publication."
    )


def _main(report: Report, networks: Sequence[Network]) -> str:
    held_out = any(row["held_out"] is not None for row in report["rows"].values())
    head = ["representation"]
    for n in networks:
        head += [f"novel: {n.called}", f"novel: kernel, {n.called}", f"recorded path: {n.called}"]
    head += ["held-out PSNR / SSIM"] if held_out else []
    head += ["the paper's FID / FVD"]
    lines: list[list[str]] = []
    for name, row in report["rows"].items():
        cells = [f"{name}{_drifting(row['drifting'], len(report['scenes']))}"]
        for n in networks:
            novel = row["novel"][n.frechet]
            cells.append(_figure(novel["value"]) + span(novel["low"], novel["high"], ".4g"))
            cells.append(_figure(row["novel"][n.kernel]["value"]))
            cells.append(_figure(row["alone"][report["recorded_path"]][n.frechet]["value"]))
        if held_out:
            found = row["held_out"]
            cells.append(NONE if found is None else f"{found['psnr']:.2f} / {found['ssim']:.3f}")
        lines.append([*cells, _of_paper(name)])
    return table(head, lines)


def _drifting(count: int, scenes: int) -> str:
    """What is said of scenes whose street is no street that stands."""
    of = "" if scenes == 1 else f" in {count} of {scenes}"
    return f" (street drifts{of})" if count else ""


def _of_paper(name: str) -> str:
    if name not in PAPER:
        return NONE
    called, fid, fvd = PAPER[name]
    return f"{called}: {fid:.2f} / {fvd:.2f}"


def _alone(report: Report, network: Network) -> str:
    rows = report["rows"]
    first = next(iter(rows.values()))["alone"]
    unit = "pictures" if network in IMAGE else "windows"
    one = next(iter(first.values()))[network.frechet]
    lines = [
        [name, *(_both(found[network.frechet]) for found in row["alone"].values())]
        for name, row in rows.items()
    ]
    lines.append(["two halves of the real ones", *(f"{NONE} / {_figure(one['floor'])}" for _ in first)])
    said = (
        f"{network.about}, each trajectory alone, {one['real_samples']} real and {one['fake_samples']} "
        f"rendered {unit}: all / half against half, which the last row can be compared with"
    )
    return f"{said}\n\n{table(['representation', *first], lines)}"


def _both(found: dict[str, Any]) -> str:
    return f"{_figure(found['value'])} / {_figure(found['half'])}"


def _figure(value: float) -> str:
    return f"{value:.4g}"
