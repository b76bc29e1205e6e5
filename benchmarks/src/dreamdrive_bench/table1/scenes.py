"""Scenes of all representations that share what does not depend on the representation, kept on disk."""

import shutil
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from dreamdrive.files.digest import digest
from dreamdrive.files.json_file import read_json
from dreamdrive.generate import generate
from dreamdrive.run import REPORT, program_digest
from dreamdrive.scene.scene import Scene
from dreamdrive.stored import load_scene
from dreamdrive_bench.common.keep import is_current, load, save
from dreamdrive_bench.table1.case import Case

SHARED = ("prior", "look", "geometry", "initialise", "static")
"""Stages that all representations of a scene begin with."""


@dataclass(frozen=True)
class Made:
    """A scene on disk.

    Attributes:
        folder: Where it lies.
        key: Of everything it follows from.
        record: What is told of it.
    """

    folder: Path
    key: str
    record: dict[str, Any]

    def load(self) -> Scene:
        """The scene itself."""
        return load_scene(self.folder)


def made(case: Case, representation: str, runs: Path) -> Made:
    """The scene of a representation, from the disk if it is there.

    All of a case are made in one folder, so that the stages of ``SHARED`` are computed once; a copy of each
    scene is what counts.
    """
    request = case.request(representation)
    key = digest([request.document, program_digest()])
    folder = runs / "scenes" / case.name / representation
    about = folder.with_name(f"{representation}.json")
    if not (is_current(about, key) and folder.exists()):
        about.unlink(missing_ok=True)
        work = runs / "work" / case.name
        outcome = generate(
            request.control,
            work,
            prior=case.prior,
            weights=case.weights,
            options=request.options,
            force=True,
        )
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(work / "scene", folder)
        report = read_json(work / REPORT)
        save(about, key, {"outcome": asdict(outcome), **told(report)})
    record = load(about)
    assert record is not None
    return Made(folder, key, {name: value for name, value in record.items() if name != "key"})


def told(report: dict[str, Any]) -> dict[str, Any]:
    """What of a report counts here."""
    stages = {name: report["stages"][name]["seconds"] for name in report["stages"]}
    shared = [name for name in SHARED if name in report["stages"] and report["stages"][name]["cached"]]
    return {
        "held_out": report["held_out_mean"],
        "held_out_frames": len(report["held_out"]),
        "blended": report["baselines"].get("flow_interpolation", {}).get("mean"),
        "gaussians": report["gaussians"],
        "actors": len(report["actors"]),
        "size": report["frames"]["size"],
        "steps": report["steps"],
        "seconds": stages,
        "taken_from_another": shared,
        "rough": report["rough"],
    }
