"""What the geometry benchmark keeps on disk, and what of it counts."""

import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest

from dreamdrive_bench import clips
from dreamdrive_bench.geometry import backends, cases, jobs
from dreamdrive_bench.geometry.report import markdown, report_of


@dataclass(frozen=True)
class Job(cases.Measurement):
    option: int = 1
    fails: bool = False
    made: list[int] = field(default_factory=list)

    @property
    def name(self) -> str:
        return "job"

    @property
    def case(self) -> dict[str, Any]:
        return {"option": self.option}

    def measure(self, runs: Path) -> dict[str, Any]:
        self.made.append(self.option)
        if self.fails:
            raise ValueError("depth is not finite")
        return {"figure": len(self.made)}


def test_a_row_has_its_case_its_figures_and_its_origin(tmp_path: Path) -> None:
    job = Job()
    assert cases.measure_all([job], tmp_path) == []
    row = cases.load(job, tmp_path)
    assert (row["option"], row["figure"], row["measurement"]) == (1, 1, "job")
    assert set(row["measured_on"]) >= {"date", "commit", "processor", "torch"}
    assert [file.name for file in (tmp_path / "cases").iterdir()] == ["job.json"]


def test_what_is_there_counts_until_it_is_forgotten(tmp_path: Path) -> None:
    job = Job()
    cases.measure_all([job], tmp_path)
    cases.measure_all([job], tmp_path)
    assert len(job.made) == 1
    cases.forget([job], tmp_path)
    assert cases.load(job, tmp_path) is None
    cases.measure_all([job], tmp_path)
    assert len(job.made) == 2


def test_a_file_that_is_cut_short_is_measured_again(tmp_path: Path) -> None:
    job = Job()
    cases.measure_all([job], tmp_path)
    file = cases.result_of(job, tmp_path)
    for text in (file.read_text()[:20], ""):
        file.write_text(text)
        assert cases.load(job, tmp_path) is None
        assert report_of([job], tmp_path)["measured"] == 0
        cases.measure_all([job], tmp_path)
        assert cases.load(job, tmp_path) is not None
    assert len(job.made) == 3


def test_another_case_of_the_same_name_does_not_count(tmp_path: Path) -> None:
    job = Job()
    cases.measure_all([job], tmp_path)
    other = replace(job, option=2)
    assert cases.load(other, tmp_path) is None
    cases.measure_all([other], tmp_path)
    assert cases.load(other, tmp_path)["option"] == 2


def test_a_failure_is_kept_as_such_and_tried_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    job = Job(fails=True)
    assert cases.measure_all([job], tmp_path) == [job]
    assert cases.load(job, tmp_path)["failed"] == "ValueError: depth is not finite"
    assert "job: ValueError: depth is not finite" in capsys.readouterr().err
    report = report_of([job], tmp_path)
    assert (report["measured"], report["failed"]) == (0, 1)
    mended = replace(job, fails=False)
    assert cases.measure_all([mended], tmp_path) == []
    assert "failed" not in cases.load(mended, tmp_path)


def test_the_row_of_a_report_keeps_the_day_it_was_measured(tmp_path: Path) -> None:
    job = Job()
    cases.measure_all([job], tmp_path)
    file = cases.result_of(job, tmp_path)
    row = json.loads(file.read_text())
    row["measured_on"]["date"] = "2020-01-01"
    file.write_text(json.dumps(row))
    report = report_of([job], tmp_path)
    assert "2020-01-01" in markdown(report)


def test_a_scene_is_made_anew_and_its_seconds_are_not_kept(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    old = tmp_path / "clips" / "pandaset-draft"
    old.mkdir(parents=True)
    (old / "report.json").touch()

    def measure(name: str, run: Any, out: Path) -> dict[str, Any]:
        assert not out.exists()
        return {"name": name, "seconds": 1.0, "stages": {"fit": 1.0}, "held_out": {"psnr": 30.0}}

    monkeypatch.setattr(clips, "measure", measure)
    job = jobs.SceneRun("pandaset-draft")
    assert job.measure(tmp_path) == {"name": "pandaset-draft", "held_out": {"psnr": 30.0}}
    assert "--refine-poses" in jobs.SceneRun("pandaset-files-refined-draft").case["settings"]["options"]
    assert str(clips.DATA) not in str(jobs.SceneRun("pandaset-files-refined-draft").case)


def test_what_ways_of_getting_geometry_are_made_from_is_part_of_the_case() -> None:
    known, unknown = (backends.BackendRun(clip, "classical") for clip in ("KITTI 04", backends.UNCALIBRATED))
    assert known.case["settings"]["intrinsics"] == "meta.json"
    assert unknown.case["settings"]["intrinsics"] is None
    wanted = jobs.everything()
    assert unknown.name in [job.name for job in wanted]
    assert backends.BackendRun(backends.UNCALIBRATED, "files").name not in [job.name for job in wanted]
