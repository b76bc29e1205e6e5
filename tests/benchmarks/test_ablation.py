"""The ablation: what its variants change, and means against all parts."""

import importlib
from dataclasses import asdict
from pathlib import Path
from types import ModuleType

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"


@pytest.fixture
def ablation(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(FOLDER))
    return importlib.import_module("ablation")


def test_each_variant_changes_something_and_hybrid_nothing(ablation: ModuleType) -> None:
    def same(variant) -> bool:
        options = asdict(variant.change(ablation.QUALITY)) == asdict(ablation.QUALITY)
        return options and variant.features == "appearance" and variant.representation == "hybrid"

    assert [name for name, variant in ablation.VARIANTS.items() if same(variant)] == ["hybrid"]


def test_all_steps_are_equal(ablation: ModuleType) -> None:
    steps = {variant.change(ablation.QUALITY).fit.steps for variant in ablation.VARIANTS.values()}
    assert steps == {ablation.QUALITY.fit.steps}


def test_every_fit_has_a_file_of_its_own(ablation: ModuleType) -> None:
    wanted = ablation.cuts(ablation.options_of([]))
    assert len({cut.result for cut in wanted}) == len(wanted) == 4 * 2 * len(ablation.VARIANTS)


def test_changes_are_world_by_world(ablation: ModuleType) -> None:
    def record(seed: int, variant: str, value: float, fake: float | None = 0.0) -> dict[str, object]:
        figures = dict.fromkeys(ablation.FIGURES, value)
        return {"seed": seed, "references": "clean", "variant": variant, **figures, "fake_m": fake}

    records = [record(seed, "hybrid", 10.0 * seed) for seed in range(3)]
    records += [record(seed, "static", 10.0 * seed - 1, None) for seed in range(1, 3)]
    (table,) = ablation.tables(records)
    row = table["rows"][1]
    assert row["worlds"] == 2
    assert row["novel_psnr_change"] == pytest.approx(-1)
    assert row["fake_m"] is None
    assert "(-1.00)" in ablation.markdown([table])
