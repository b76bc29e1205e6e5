"""The street benchmark's bookkeeping: which fits there are, steps at equal time, paired differences."""

import argparse
import shutil
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import cv2
import numpy as np
import pytest

from dreamdrive.options import Options
from dreamdrive_bench.common import keep
from dreamdrive_bench.common.report import as_json
from dreamdrive_bench.street import (
    consistency,
    fit as fits,
    jobs as jobs_of,
    main as street,
    methods,
    picture as pictures,
    renderer,
)
from dreamdrive_bench.street.case import VIEWS
from tests.scene.scenes import make_scene


def options(*arguments: str) -> argparse.Namespace:
    return street.options_of(arguments=list(arguments))


def test_quick_is_two_worlds_one_geometry_three_representations() -> None:
    wanted = list(street.jobs(options("--quick")))
    assert {job.case.seed for job in wanted} == {0, 1}
    assert {job.case.geometry for job in wanted} == {"true"}
    assert len({job.method for job in wanted}) == 3
    assert len(wanted) == 2 * 3 * 2


def test_a_full_run_has_every_row_once_the_most_telling_first() -> None:
    wanted = list(street.jobs(options()))
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
    assert all(job.method != "hybrid" for job in wanted if job.budget != "equal_steps")


def test_steps_at_equal_time_follow_from_both_timed_now(monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = methods.options_of("hexplane")
    asked: list[tuple[str, int]] = []
    costs = {"hybrid": fits.Cost(30, 5.0, 0.1, 1), "hexplane": fits.Cost(30, 8.0, 0.25, 1)}

    def timed(begin: None, given: Options) -> object:
        asked.append((given.representation, given.fit.steps))
        return fits.Fitted(None, costs.get(given.representation))

    monkeypatch.setattr(fits, "fit_case", timed)
    plan = fits.equal_time(None, wanted)
    # Hybrid: 2 s once and 0.1 s a step; hexplane: half a second once and 0.25 s a step.
    whole = 2 + 0.1 * wanted.fit.steps
    assert asked[1:] == [("hybrid", fits.PROBE_STEPS), ("hexplane", fits.PROBE_STEPS)]
    assert plan["hybrid_s"] == pytest.approx(whole)
    assert plan["steps"] == pytest.approx((whole - 0.5) / 0.25, abs=0.5)
    assert costs["hexplane"].of_steps(plan["steps"]) == pytest.approx(whole, rel=0.01)


@pytest.fixture
def keys(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Jobs of worlds that are not drawn."""
    monkeypatch.setattr(jobs_of, "case_digest", lambda case: case.name)
    monkeypatch.setattr(jobs_of, "views_digest", lambda seed: str(seed))
    return jobs_of


def test_a_fit_of_other_options_counts_as_not_there(
    keys: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    given = options("--runs", str(tmp_path), "--resume")
    toolbox = street.Toolbox()
    wanted = {(job.method, job.budget): job for job in street.jobs(given) if job.case.name == "0-true-clean"}
    for job in wanted.values():
        keep.save(job.result, job.key(toolbox), {}, {})
    assert all(street.is_done(job, toolbox) for job in wanted.values())
    score = replace(methods.QUALITY.score, steps=7)
    monkeypatch.setattr(methods, "QUALITY", replace(methods.QUALITY, score=score))
    street.clear(list(wanted.values()), given, toolbox)
    assert not any(job.result.exists() for job in wanted.values())


def test_a_fit_of_another_program_counts_as_not_there(
    keys: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = next(iter(street.jobs(options())))
    before = job.fit_key
    monkeypatch.setattr(fits, "program_digest", lambda: "another")
    assert job.fit_key != before


def test_methods_differ_and_take_equal_steps() -> None:
    every = [methods.options_of(name) for name in methods.METHODS]
    assert len({fits.key_of("case", each) for each in every}) == len(every)
    assert {(each.static.steps, each.fit.steps) for each in every} == {
        (methods.QUALITY.static.steps, methods.QUALITY.fit.steps)
    }
    planes = methods.options_of("hexplane-4x32").motion
    assert (planes.levels, planes.features) == (4, 32)


def test_worlds_of_two_sets_have_no_mean(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        options("--seeds", "0", "1000")
    assert "worlds of several sets: development, test" in capsys.readouterr().err
    with pytest.raises(ValueError, match="several sets"):
        street.summary([record(seed, "hybrid", 20.0) for seed in (7, 1000)], {}, {})
    assert options("--worlds", "test").seeds == list(range(1000, 1016))


def test_means_are_over_the_worlds_that_all_rows_have() -> None:
    records = [record(seed, "hybrid", 20.0 + seed) for seed in range(3)]
    records += [record(seed, "static", 19.0 + seed) for seed in (0, 2)]
    found = street.summary(records, {}, {})
    (table,) = found["tables"]
    assert table["worlds"] == [0, 2]
    assert [row["held_out_psnr"] for row in table["means"]] == pytest.approx([21, 20])
    assert "these development worlds: 0, 2." in street.markdown({"tables": [table]})


def test_other_views_are_measured_again_and_not_fitted_again(
    keys: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = next(iter(street.jobs(options())))
    before = job.fit_key, job.key(street.Toolbox())
    monkeypatch.setattr(keys, "views_digest", lambda seed: f"other {seed}")
    assert job.fit_key == before[0]
    assert job.key(street.Toolbox()) != before[1]


def test_measuring_again_keeps_scenes_and_starting_anew_does_not(keys: ModuleType, tmp_path: Path) -> None:
    job = next(job for job in street.jobs(options("--runs", str(tmp_path))))
    about = job.scene.with_name(f"{job.scene.name}.json")
    for argument, scene_stays in (("--measure-again", True), ("--quick", False)):
        job.scene.mkdir(parents=True, exist_ok=True)
        keep.save(about, job.fit_key, {})
        keep.save(job.result, job.key(street.Toolbox()), {}, {})
        street.clear([job], options(argument), street.Toolbox())
        assert not job.result.exists()
        assert (about.exists(), job.scene.exists()) == (scene_stays, scene_stays)


def test_a_fit_is_made_once(tmp_path: Path) -> None:
    made: list[int] = []

    def make() -> object:
        made.append(1)
        return fits.Fitted(make_scene(), fits.Cost(3, 1.0, 0.1, 1))

    first, again = (fits.kept_fit(tmp_path / "a", "key", make) for _ in range(2))
    assert len(made) == 1
    assert first.cost == again.cost == fits.Cost(3, 1.0, 0.1, 1)
    assert len(again.scene.static) == len(make_scene().static)
    fits.kept_fit(tmp_path / "a", "other key", make)
    assert len(made) == 2
    shutil.rmtree(tmp_path / "a")
    fits.kept_fit(tmp_path / "a", "other key", make)
    assert len(made) == 3


def record(seed: int, name: str, psnr: float) -> dict[str, object]:
    views = {view: {"psnr": psnr, "ssim": 0.9, "frames": 24} for view in VIEWS}
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


def test_differences_are_paired_over_worlds() -> None:
    rng = np.random.default_rng(0)
    hard = rng.normal(25, 5, 8)  # worlds differ by far more than representations do
    records = [record(s, "hybrid", hard[s] + 1.0) for s in range(8)]
    records += [record(s, "static", hard[s]) for s in range(8)]
    records += [record(s, "vibration", hard[s] + 0.5) for s in range(8)]
    (table,) = street.summary(records, {}, {})["tables"]
    gain = table["against_best_other"]["novel"]
    assert gain["best_other"] == "vibration"
    assert gain["db"] == pytest.approx(0.5)
    assert gain["low"] == pytest.approx(0.5)
    text = street.markdown({"tables": [table]})
    assert "hybrid less the best other" in text
    assert text.index("| hybrid |") < text.index("| vibration |") < text.index("| static |")


def test_the_recording_follows_the_fits_at_equal_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jobs_of, "recording", lambda: Path("clip"))
    given = options()
    clips = jobs_of.recorded(given)
    assert [job.method for job in clips] == list(street.REPRESENTATIONS)
    everything = jobs_of.in_order(list(street.jobs(given)), clips)
    places = [number for number, job in enumerate(everything) if job in clips]
    assert places == list(range(5 * 8 * 5, 5 * 8 * 5 + 5))
    assert jobs_of.recorded(options("--quick")) == []
    monkeypatch.setattr(jobs_of, "recording", lambda: None)
    assert jobs_of.recorded(given) == []


def test_consistency_is_compared_with_the_references_and_the_truth() -> None:

    def figures(value: float | None) -> dict[str, float | None]:
        found = {consistency.SHARPNESS: 7.0, consistency.FOUND_BY: "structure from motion"}
        return {**dict.fromkeys(consistency.MEASURES, value), **found}

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
    found[1]["consistency"]["references"][consistency.FOUND_BY] = "odometry"  # rougher: no like for like
    (other,) = consistency.consistency_tables(found)
    worlds = {row["measure"]: row["worlds"] for row in other["rows"]}
    assert worlds["ate_percent"] == 1
    assert worlds["translation_percent"] == 2
    assert worlds["warp_1"] == worlds["epipolar_miss_8"] == 3
    assert "odometry in 1" in street.markdown({"tables": [], "consistency": [other]})
    text = street.markdown({"tables": [], "consistency": [table]})
    assert "9 of 9 errors are at most half" in text
    assert "rendered 7.00" in text


def test_a_blurred_video_is_less_sharp() -> None:
    frames = np.random.default_rng(0).integers(0, 256, (2, 24, 32, 3), np.uint8)
    blurred = np.stack([cv2.GaussianBlur(frame, (0, 0), 2) for frame in frames])
    assert consistency.sharpness(blurred) < 0.5 * consistency.sharpness(frames)


def test_the_recording_has_a_table() -> None:
    row = {"representation": "static", "size": [320, 180], "frames": 24, "steps": 300, "seconds": 1.0}
    row |= {"threads": 1, "psnr": 20.0, "ssim": 0.7, "moving_iou": None, "moving_psnr": 15.0}
    text = street.markdown({"tables": [], "recording": [row]})
    assert "24 frames of 320x180" in text
    assert "| static | 300 | 1.0 | 20.00 / 0.700 | - | 15.00 |" in text


def test_the_grid_has_a_head_and_a_column_for_each_representation_there_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    width, height = pictures.SIZE
    frames = np.zeros((13, height, width, 3), np.uint8)
    monkeypatch.setattr(pictures, "true_frames", lambda *_: frames)
    kept = tmp_path / "shown" / f"0-{pictures.SHOWN.format('static')}.png"
    kept.parent.mkdir()
    cv2.imwrite(str(kept), frames[0])
    street.picture(tmp_path / "grid.png", [0, 1], tmp_path)
    image = cv2.imread(str(tmp_path / "grid.png"))
    assert image.shape == (pictures.HEAD + 2 * height, pictures.MARGIN + 2 * width, 3)


def test_the_report_of_a_full_run_is_small_enough_to_commit() -> None:
    records = [
        {
            **record(0, job.method, 21.123456789),
            "consistency": {"a": dict.fromkeys(range(27), 1 / 3)},
        }
        for job in street.jobs(options())
    ]
    text = as_json({"rows": records})
    assert len(text) < 500_000
    assert "21.1235" in text
    assert "21.12345" not in text


def test_each_claim_is_told_with_its_figure() -> None:
    records = [record(s, "hybrid", 25.6) | {"mask_iou": 0.8, "fake_m": 0.003} for s in range(3)]
    records += [record(s, "deformable", 25.0) | {"fake_m": 0.01} for s in range(3)]
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
def test_a_gain_has_to_be_sure(low: float, holds: bool) -> None:
    gain = {"best_other": "static", "db": 0.6, "low": low, "high": 1.0}
    about = {"geometry": "true", "references": "corrupted", "budget": "equal_steps"}
    empty = {"distances_compared": [], "means": []}
    table = {**about, **empty, "against_best_other": {"held_out": gain, "novel": gain}}
    assert street.claims({"tables": [table]})[0]["holds"] is holds


def test_an_undecided_ratio_is_neither_kept_nor_broken() -> None:
    ratio = {
        "network": "fid",
        "projected": True,
        "against": "best other",
        "ours_over_this": 0.8,
        "ratio_low": 0.6,
    }
    row = {**ratio, "ratio_high": 1.1, "undecided": True}
    about = {"geometry": "true", "references": "corrupted", "budget": "equal_steps"}
    alone = {**row, "ours_over_this": None, "ratio_low": None, "ratio_high": None}
    bare = {**about, "distances_compared": [alone], "means": [], "against_best_other": {}}
    (claim,) = street.claims({"tables": [bare]})
    assert (claim["holds"], claim["measured"]) == (None, "the other has no excess")
    table = {**about, "distances_compared": [row], "means": [], "against_best_other": {}}
    (claim,) = street.claims({"tables": [table]})
    assert claim["holds"] is None
    text = street.markdown({"tables": [], "claims": [claim]})
    assert "| at most 0.85 | 0.80 (0.60 to 1.10) | undecided |" in text


def test_tables_tell_frames_time_and_worlds() -> None:
    records = [record(s, name, 20.0) for s in range(2) for name in ("hybrid", "static")]
    for row in records:
        row["mask_iou"], row["seconds"] = 0.25 + row["seed"] / 2, 50.0 + 20 * row["seed"]
        row["views"]["shift_3"] = {"psnr": 12.0, "ssim": 0.5, "frames": 13}
    late = [{**row, "budget": "equal_time", "hybrid_s": 50.0} for row in records[1::2]]
    text = street.markdown(street.summary([*records, *late], {}, {}))
    assert "of 48 a view but the held-out ones: held_out 48, shift_1 48, shift_2 48, shift_3 26" in text
    assert "| static | 2 | 1 | 60.0 | 1.20 (1.00 to 1.40), off by more than 10 % |" in text
    assert "| 0 | - | - | - | - |" not in text
    assert "| 1 | 0.75 | - | - | - |" in text
    assert "| mean | 0.50 | - | - | - |" in text
    assert "| hybrid | equal_steps | 60.0 | 70.0 | 60 | no |" in text


def test_the_renderer_has_its_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(renderer, "FRAMES", 2)
    monkeypatch.setattr(renderer, "SIZE", (32, 20))
    found = renderer.frames_a_second(0)
    assert min(found["antialiased"], found["one_ray"]) > 0
    text = street.markdown({"tables": [], "renderer": {**found, "antialiased": 12.34}})
    assert "at 32x20, all truth included: antialiased 12.3 (asked: 10 on two cores), one_ray" in text


def test_a_view_without_frames_leaves_its_world_out() -> None:
    records = [record(s, "hybrid", 21.0) for s in range(3)]
    records += [record(s, "static", 20.0) for s in range(3)]
    for row in records[::3]:
        row["views"]["shift_3"] = {"psnr": None, "ssim": None, "frames": 0}
    (table,) = street.summary(records, {}, {})["tables"]
    assert table["against_best_other"]["shift_3"]["worlds"] == 2
    assert table["against_best_other"]["shift_2"]["worlds"] == 3
    assert table["means"][0]["shift_3_psnr"] == 21.0
