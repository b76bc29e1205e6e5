"""The street benchmark's bookkeeping: which fits there are, steps at equal time, paired differences."""

import argparse
import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType

import cv2
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
    views = {view: {"psnr": psnr, "ssim": 0.9} for view in sys.modules["_street_case"].VIEWS}
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


def test_the_recording_follows_the_fits_at_equal_steps(
    street: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs_of = sys.modules["_street_jobs"]
    monkeypatch.setattr(jobs_of, "recording", lambda: Path("clip"))
    given = options(street)
    clips = jobs_of.recorded(given)
    assert [job.representation for job in clips] == list(street.REPRESENTATIONS)
    everything = jobs_of.in_order(list(street.jobs(given)), clips)
    places = [number for number, job in enumerate(everything) if job in clips]
    assert places == list(range(5 * 8 * 5, 5 * 8 * 5 + 5))
    assert jobs_of.recorded(options(street, "--quick")) == []
    monkeypatch.setattr(jobs_of, "recording", lambda: None)
    assert jobs_of.recorded(given) == []


def test_consistency_is_compared_with_the_references_and_the_truth(street: ModuleType) -> None:
    consistency = sys.modules["_street_consistency"]

    def figures(value: float | None) -> dict[str, float | None]:
        return {**dict.fromkeys(consistency.MEASURES, value), consistency.SHARPNESS: 7.0}

    found = [
        {
            "geometry": "true",
            "consistency": {"truth": figures(1.0), "references": figures(3.0 + k), "rendered": figures(1.5)},
        }
        for k in range(3)
    ]
    lost = {**figures(1.5), "ate_percent": None}  # no path was found in one video
    found[0]["consistency"]["rendered"] = lost
    (table,) = consistency.consistency_tables([*found, {"geometry": "true"}])
    rows = {row["measure"]: row for row in table["rows"]}
    assert rows["warp_4"]["ratio"] == pytest.approx(1.5 / 4)
    assert rows["warp_4"]["excess_ratio"] == pytest.approx(0.5 / 3)
    assert rows["ate_percent"]["worlds"] == 2
    assert len(table["at_most_half"]) == len(consistency.MEASURES)
    text = street.markdown({"tables": [], "consistency": [table]})
    assert "9 of 9 errors are at most half" in text
    assert "rendered 7.00" in text


def test_a_blurred_video_is_less_sharp(street: ModuleType) -> None:
    consistency = sys.modules["_street_consistency"]
    frames = np.random.default_rng(0).integers(0, 256, (2, 24, 32, 3), np.uint8)
    blurred = np.stack([cv2.GaussianBlur(frame, (0, 0), 2) for frame in frames])
    assert consistency.sharpness(blurred) < 0.5 * consistency.sharpness(frames)


def test_the_recording_has_a_table(street: ModuleType) -> None:
    row = {"representation": "static", "size": [320, 180], "frames": 24, "steps": 300, "seconds": 1.0}
    row |= {"threads": 1, "psnr": 20.0, "ssim": 0.7, "moving_iou": None, "moving_psnr": 15.0}
    text = street.markdown({"tables": [], "recording": [row]})
    assert "24 frames of 320x180" in text
    assert "| static | 300 | 1.0 | 20.00 / 0.700 | - | 15.00 |" in text


def test_the_grid_has_a_head_and_a_column_for_each_representation_there_is(
    street: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tables = sys.modules["_street_table"]
    width, height = tables.SIZE
    frames = np.zeros((13, height, width, 3), np.uint8)
    monkeypatch.setattr(tables, "true_frames", lambda *_: frames)
    kept = tmp_path / "shown" / f"0-{tables.SHOWN.format('static')}.png"
    kept.parent.mkdir()
    cv2.imwrite(str(kept), frames[0])
    street.picture(tmp_path / "grid.png", [0, 1], tmp_path)
    image = cv2.imread(str(tmp_path / "grid.png"))
    assert image.shape == (tables.HEAD + 2 * height, tables.MARGIN + 2 * width, 3)


def test_the_report_of_a_full_run_is_small_enough_to_commit(street: ModuleType) -> None:
    records = [
        {
            **record(0, job.representation, 21.123456789, street),
            "consistency": {"a": dict.fromkeys(range(27), 1 / 3)},
        }
        for job in street.jobs(options(street))
    ]
    text = street.as_text({"rows": records})
    assert len(text) < 500_000
    assert "21.1235" in text
    assert "21.12345" not in text


def test_each_claim_is_told_with_its_figure(street: ModuleType) -> None:
    records = [record(s, "hybrid", 25.6, street) | {"mask_iou": 0.8, "fake_m": 0.003} for s in range(3)]
    records += [record(s, "deformable", 25.0, street) | {"fake_m": 0.01} for s in range(3)]
    corrupted = [{**row, "references": "corrupted"} for row in records]
    tables = street.summary([*records, *corrupted], {}, {})["tables"]
    found = {row["about"]: row for row in street.claims({"tables": tables})}
    holds = {about: row["holds"] for about, row in found.items()}
    assert holds == {
        "true geometry, clean references: the worst view": True,
        "true geometry, clean references: IoU of the moving mask": True,
        "true geometry, clean references: fake motion": False,
        "true geometry, corrupted references: PSNR of held_out less the best other's": True,
        "true geometry, corrupted references: PSNR of novel less the best other's": True,
        "true geometry, corrupted references: the worst view": True,
        "true geometry, corrupted references: fake motion": False,
    }
    assert found["true geometry, clean references: fake motion"]["measured"] == "3 mm of 10 mm"


@pytest.mark.parametrize(("low", "holds"), [(0.1, True), (-0.1, False)])
def test_a_gain_has_to_be_sure(street: ModuleType, low: float, holds: bool) -> None:
    gain = {"best_other": "static", "db": 0.6, "low": low, "high": 1.0}
    about = {"geometry": "true", "references": "corrupted", "budget": "equal_steps"}
    empty = {"distances_compared": [], "means": []}
    table = {**about, **empty, "against_best_other": {"held_out": gain, "novel": gain}}
    assert street.claims({"tables": [table]})[0]["holds"] is holds


def test_an_undecided_ratio_is_neither_kept_nor_broken(street: ModuleType) -> None:
    ratio = {"network": "fid", "against": "best other", "ours_over_this": 0.8, "ratio_low": 0.6}
    row = {**ratio, "ratio_high": 1.1, "undecided": True}
    about = {"geometry": "true", "references": "corrupted", "budget": "equal_steps"}
    table = {**about, "distances_compared": [row], "means": [], "against_best_other": {}}
    (claim,) = street.claims({"tables": [table]})
    assert claim["holds"] is None
    text = street.markdown({"tables": [], "claims": [claim]})
    assert "| at most 0.85 | 0.80 (0.60 to 1.10) | undecided |" in text
