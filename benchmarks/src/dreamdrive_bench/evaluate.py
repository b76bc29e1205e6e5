"""What ``dreamdrive evaluate`` says of a few scenes and videos, to show how large its figures are.

Development worlds and clips. What the commands print replaces the sections of
``docs/results/figures_of_evaluate.md``; their figures go to ``--json``.
"""

import json
import subprocess
from pathlib import Path
from typing import Any

from dreamdrive_bench.clips import RUNS, SHORT
from dreamdrive_bench.common.machine import describe_machine
from dreamdrive_bench.common.markdown import replace_section
from dreamdrive_bench.common.options import parser_of
from dreamdrive_bench.common.places import DATA, DREAMDRIVE
from dreamdrive_bench.common.report import as_json, write
from dreamdrive_bench.common.twin import TWIN

PAGE = Path("docs/results/figures_of_evaluate.md")
PANDASET = DATA / "clips/pandaset_002"
KITTI = DATA / "clips/kitti_odom04_follow_van"
CLIPS = {
    "pandaset": [str(PANDASET / RUNS["pandaset-draft"].source), *RUNS["pandaset-draft"].options],
    "kitti": [str(KITTI / "frames"), "--frames", "0:26:1", "--fps", "10", "--size", "480x144", *SHORT],
}
CLIPS["kitti"] += ["--camera-height", "1.65", "--intrinsics", str(KITTI / "meta.json")]


def told(*arguments: str) -> str:
    """What a command prints."""
    done = subprocess.run([*DREAMDRIVE, *arguments], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"dreamdrive {' '.join(arguments)}: {done.stderr.strip()}")
    return done.stdout


def world(runs: Path, seed: int, size: str, frames: int, *more: str) -> Path:
    """A drawn street."""
    out = runs / "-".join([f"street-{seed}-{size}", *(word.strip("-") for word in more)])
    shape = ["--seed", str(seed), "--size", size, "--frames", str(frames)]
    told("world", "make", *shape, *more, "--force", "-o", str(out))
    return out


def scene(runs: Path, name: str, source: list[str]) -> Path:
    """A draft of a scene."""
    out = runs / f"scene-{name}"
    told("generate", *source, "--knowledge", TWIN, "--force", "-o", str(out))
    return out


def commands(runs: Path) -> dict[str, list[tuple[str, list[str]]]]:
    """What is measured, by section: a title and the arguments of ``evaluate``."""
    clean, generated = (world(runs, 1, "320x192", 24, *more) for more in ([], ["--corrupt", "generated"]))
    videos = {"Street of seed 1, as it is": clean, "The same with `--corrupt generated`": generated}
    streets = {seed: world(runs, seed, "240x144", 16) for seed in (1, 2)}
    scenes: dict[int, Path] = {}
    for seed, made in streets.items():
        source = [str(made / "frames"), "--intrinsics", str(made / "cameras.json"), *SHORT]
        scenes[seed] = scene(runs, f"street-{seed}", source)
    clips = {name: scene(runs, name, source) for name, source in CLIPS.items()}
    truth = {"PandaSet 002": (clips["pandaset"], PANDASET), "KITTI 04": (clips["kitti"], KITTI)}
    truth["Street of seed 1"] = scenes[1], streets[1]
    follow = ["--trajectory", str(clean / "poses.json"), "--intrinsics", str(clean / "cameras.json")]
    return {
        "consistency": [
            (title, ["consistency", str(made / "frames"), *follow]) for title, made in videos.items()
        ],
        "decomposition": [
            (f"Street of seed {seed}", ["decomposition", str(scenes[seed]), str(streets[seed])])
            for seed in streets
        ],
        "geometry": [
            (title, ["geometry", str(out), "--truth", str(true)]) for title, (out, true) in truth.items()
        ],
    }


def measure(arguments: list[str], figures: Path) -> tuple[str, dict[str, Any]]:
    """What ``evaluate`` prints, and its figures."""
    printed = told("evaluate", *arguments, "--json", str(figures))
    kept = [line.rstrip() for line in printed.splitlines() if line.strip() != str(figures)]
    return "\n".join(kept).strip("\n"), json.loads(figures.read_text())


def main() -> int:
    """Make the scenes, measure, write."""
    options = parser_of(__doc__, runs="runs/evaluate").parse_args()
    options.runs.mkdir(parents=True, exist_ok=True)
    report: dict[str, Any] = {"machine": describe_machine()}
    for section, each in commands(options.runs).items():
        report[section], parts = {}, list[str]()
        for title, arguments in each:
            printed, report[section][title] = measure(arguments, options.runs / "figures.json")
            parts.append(f"{title}:\n\n```\n{printed}\n```")
        replace_section(PAGE, section, "\n\n".join(parts))
    write(options.json, as_json(report))
    return 0
