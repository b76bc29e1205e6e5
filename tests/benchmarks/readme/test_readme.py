"""The README's figures: which fits and clips, what the tables say, and when pages are written."""

import json
from pathlib import Path
from typing import Any

import pytest

from dreamdrive_bench import clips
from dreamdrive_bench.common.worlds import DEVELOPMENT, TEST
from dreamdrive_bench.readme import main as readme, tables

PAGE = """Before.
<!-- {name}: begin -->
old
<!-- {name}: end -->
After.
"""
MACHINE = {"date": "2026-11-23", "commit": "abc", "cores": 2, "processor": "a processor", "isa": "avx2"}


def fit(seed: int, method: str = "hybrid", references: str = "clean", iou: float = 0.5) -> dict[str, Any]:
    views = {view: {"psnr": 20.0 + iou} for view in ("held_out", "shift_2")}
    about = {"seed": seed, "references": references, "geometry": "estimated", "representation": method}
    return {**about, "mask_iou": iou, "views": views, "steps": 300, "seconds": 9.6}


def clip(name: str) -> dict[str, Any]:
    baselines = {"repeat_previous": 21.4, "average_neighbours": 23.0, "flow_interpolation": 25.6}
    return {
        "name": name,
        "held_out": {"psnr": 30.04, "ssim": 0.9},
        "moving_psnr": 24.39,
        "moving_iou": 0.62,
        "seconds": 230.8,
        "stages": {"prior": 2.0, "fit": 134.4},
        "peak_rss_mb": 1376.0,
        "path_error": 0.001,
        "baselines": {key: {"psnr": psnr, "ssim": 0.735} for key, psnr in baselines.items()},
        "focal": {"px": 408.0, "observed": False},
        "gaussians": {"static": 1, "dynamic": 11565},
    }


def report() -> dict[str, Any]:
    streets = [fit(seed, method) for seed in TEST[:2] for method in ("hybrid", "static")]
    streets += [fit(seed, iou=0.7) for seed in DEVELOPMENT[:2]]
    streets += [fit(seed, references="corrupted", iou=0.4) for seed in TEST[:2]]
    names = [*tables.MAIN_CLIP, *tables.OTHER_CLIPS]
    return {"machine": MACHINE, "streets": streets, "clips": [clip(name) for name in names]}


def test_all_test_worlds_count_and_hybrid_alone_is_fitted_to_those_of_the_development() -> None:
    jobs = readme.jobs_of(readme.options_of(arguments=[]))
    assert len({job.result for job in jobs}) == len(jobs) == 16 * 5 + 8 + 24
    assert {job.case.seed for job in jobs} == {*TEST, *DEVELOPMENT}
    assert {job.method for job in jobs if job.case.seed in DEVELOPMENT} == {"hybrid"}
    assert {job.case.geometry for job in jobs} == {"estimated"}
    wide = readme.jobs_of(readme.options_of(arguments=["--whole-paper"]))[len(jobs) :]
    assert {(job.case.seed, job.case.geometry) for job in wide} == {(seed, "true") for seed in TEST[:4]}
    assert {"hybrid", "deformable-8x256", "hexplane-4x32"} <= {job.method for job in wide}


def test_every_clip_of_the_tables_is_a_run_of_the_benchmark_of_clips() -> None:
    assert set(tables.MAIN_CLIP) | set(tables.OTHER_CLIPS) <= set(clips.RUNS)


def test_sections_say_what_was_measured() -> None:
    found = tables.sections(report())
    assert set(found) == {"drop", "figures", "clip", "clips"}
    assert "| moving mask, IoU, clean references | 0.70 ± 0.00 | 0.50 ± 0.00 | -0.20 |" in found["drop"]
    assert "| moving mask, IoU, corrupted references | - | 0.40 ± 0.00 | - |" in found["drop"]
    assert "| `static` | 0.50 | 20.50 | 20.50 | 300 | 10 |" in found["figures"]
    assert "Means over 2 worlds. Frames corrupted as generated video is: 0.40 of IoU." in found["figures"]
    assert "| `standard` | 30.0 / 0.900 | 24.4 | 231 |" in found["figures"]
    assert "| flow interpolation between the neighbours | 25.6 / 0.735 |  |  |" in found["figures"]
    assert "| `standard` | 30.04 / 0.900 | 24.39 | 0.620 | 0.10 % | 231 | 1.38 GB |" in found["clip"]
    assert "408, prior | 11,565 Gaussians |" in found["clips"]
    assert all("at commit abc, on 2 cores of a processor (avx2)" in text for text in found.values())


def test_no_mean_is_over_both_sets_of_worlds() -> None:
    with pytest.raises(ValueError, match="several sets"):
        tables.mean_and_error([fit(0), fit(1000)], "held out, dB")


def test_a_whole_run_writes_the_sections_that_a_page_has(tmp_path: Path) -> None:
    (tmp_path / "docs").mkdir()
    (tmp_path / "README.md").write_text(PAGE.format(name="figures"))
    (tmp_path / "docs/figures.md").write_text(PAGE.format(name="drop") + PAGE.format(name="whole-paper"))
    whole, texts = report(), tables.sections(report())
    options = readme.options_of(arguments=[])
    assert readme.finish(options, whole, texts, [], tmp_path) == 0
    assert "`standard`" in (tmp_path / "README.md").read_text()
    page = (tmp_path / "docs/figures.md").read_text()
    assert "± 0.00" in page
    assert page.count("old") == 1
    stored = json.loads((tmp_path / "benchmarks/results/readme-2026-11-23.json").read_text())
    assert stored["machine"]["commit"] == "abc"


@pytest.mark.parametrize(
    ("arguments", "failed"), [(["--quick"], []), (["--no-clips"], []), ([], ["udacity"])]
)
def test_parts_of_a_run_are_not_written(tmp_path: Path, arguments: list[str], failed: list[str]) -> None:
    options = readme.options_of(arguments=arguments)
    code = readme.finish(options, report(), tables.sections(report()), failed, tmp_path)
    assert code == bool(failed)
    assert list(tmp_path.iterdir()) == []


def test_the_pages_have_the_marks() -> None:
    root = Path(__file__).parents[3]
    assert "<!-- figures: begin -->" in (root / readme.README).read_text()
    page = (root / readme.FIGURES).read_text()
    for name in ("drop", "whole-paper", "clip", "clips"):
        assert f"<!-- {name}: begin -->" in page


def test_a_clip_is_measured_once_for_a_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []
    monkeypatch.setattr(clips, "measure", lambda name, run, out: asked.append(out.name) or clip(name))
    for _ in range(2):
        assert readme._clip("udacity", tmp_path)["seconds"] == 230.8
    assert len(asked) == 1
    monkeypatch.setattr(readme, "program_digest", lambda: "another")
    readme._clip("udacity", tmp_path)
    assert len(set(asked)) == 2
