"""Training from the command line: what it leaves, and what it says of mistakes."""

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Run
from tests.records import write_folder


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("records") / "drawn"
    write_folder(folder, range(1_000_000, 1_000_003), frames=1, kept_out=1)
    return folder


@pytest.mark.slow
def test_a_training_leaves_weights_losses_and_figures(run: Run, data: Path, tmp_path: Path) -> None:
    options = ("--steps", 2, "--batch", 1, "--mix", "drawn=2")
    done = run("train", "street", "--data", data, "-o", tmp_path, *options)
    assert done.code == 0, done.err
    assert "street.safetensors: 2 steps" in done.out
    assert "depth_rel" in done.out
    last = json.loads((tmp_path / "losses.jsonl").read_text().splitlines()[-1])
    assert last["step"] == 2
    assert (tmp_path / "street.safetensors").stat().st_size < 8.5e6


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "--data is missing"),
        (("--data", "DATA", "--steps", "0"), "expected at least one step"),
        (("--data", "DATA", "--mix", "drawn"), "expected SOURCE=WEIGHT"),
        (("--data", "DATA", "--mix", "drawn=x"), "expected SOURCE=WEIGHT"),
        (("--data", "DATA", "--mix", "sketched=2"), "no record is of sketched; sources are drawn"),
        (("--data", "none"), "none does not exist; expected a folder with records.jsonl"),
        (("--data", "DATA", "--encoder", "none.pth"), "none.pth does not exist"),
        (("--data", "DATA", "--data", "DATA"), "two folders of records have one name"),
    ],
)
def test_mistakes_are_named(
    run: Run, data: Path, tmp_path: Path, options: tuple[str, ...], said: str
) -> None:
    given = (data if each == "DATA" else each for each in options)
    done = run("train", "street", "-o", tmp_path / "out", *given)
    assert done.code == 2
    assert said in done.err
    assert not (tmp_path / "out").exists()
