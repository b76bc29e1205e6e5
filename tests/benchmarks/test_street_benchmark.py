"""The street benchmark's bookkeeping: which fits there are, steps at equal time, paired differences."""

import argparse
import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture
def street(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(FOLDER))
    spec = importlib.util.spec_from_file_location("street", FOLDER / "street.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "street", module)
    spec.loader.exec_module(module)
    return module


def options(street: ModuleType, *arguments: str) -> argparse.Namespace:
    return street.options_of(list(arguments))


def test_quick_is_two_worlds_one_geometry_three_representations(street: ModuleType) -> None:
    wanted = list(street.jobs(options(street, "--quick")))
    assert {job.case.seed for job in wanted} == {0, 1}
    assert {job.case.geometry for job in wanted} == {"true"}
    assert len({job.representation for job in wanted}) == 3
    assert len(wanted) == 2 * 3 * 2


def test_a_full_run_has_every_row_once_the_most_telling_first(street: ModuleType) -> None:
    wanted = list(street.jobs(options(street)))
    assert len({job.result for job in wanted}) == len(wanted)
    blocks = list(dict.fromkeys(job.block for job in wanted))
    assert blocks == [
        "equal_steps-true-corrupted",
        "equal_steps-true-clean",
        "equal_steps-estimated-corrupted",
        "equal_steps-estimated-clean",
        "equal_steps-unknown_focal-corrupted",
        "equal_time-true-corrupted",
        "equal_time-true-clean",
        "five_times-true-corrupted",
    ]
    assert len([job for job in wanted if job.budget == "equal_steps"]) == 5 * 8 * 5
    assert all(job.representation != "hybrid" for job in wanted if job.budget != "equal_steps")


def test_steps_at_equal_time_follow_from_measured_seconds(street: ModuleType, tmp_path: Path) -> None:
    arguments = ("--runs", str(tmp_path))
    job = next(job for job in street.jobs(options(street, *arguments)) if job.budget == "equal_time")
    jobs_of = sys.modules["_street_jobs"]
    with pytest.raises(FileNotFoundError, match="equal steps"):
        jobs_of.steps_of(job)
    for name, figures in ("hybrid", {"seconds": 12.0}), (job.representation, {"step_s": 0.1}):
        path = job.with_equal_steps(name).result
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps({**figures, "threads": 1}))
    assert jobs_of.steps_of(job) == 120


def record(seed: int, name: str, psnr: float, street: ModuleType) -> dict[str, object]:
    views = {view: {"psnr": psnr, "ssim": 0.9} for view in street.VIEWS}
    about = {"seed": seed, "geometry": "true", "references": "clean", "representation": name}
    return {
        **about,
        "budget": "equal_steps",
        "steps": 1,
        "seconds": 1.0,
        "threads": 1,
        "mask_iou": None,
        "fake_m": 0.0,
        "views": views,
    }


def test_differences_are_paired_over_worlds(street: ModuleType) -> None:
    rng = np.random.default_rng(0)
    hard = rng.normal(25, 5, 8)  # worlds differ by far more than representations do
    records = [record(s, "hybrid", hard[s] + 1.0, street) for s in range(8)]
    records += [record(s, "static", hard[s], street) for s in range(8)]
    records += [record(s, "vibration", hard[s] + 0.5, street) for s in range(8)]
    (table,) = street.summary(records, {}, {})["tables"]
    gain = table["against_best_other"]["novel"]
    assert gain["best_other"] == "vibration"
    assert gain["db"] == pytest.approx(0.5)
    assert gain["low"] == pytest.approx(0.5)
    text = street.markdown({"tables": [table]})
    assert "hybrid less the best other" in text
    assert text.index("| hybrid |") < text.index("| vibration |") < text.index("| static |")
