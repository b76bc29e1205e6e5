"""Results of planners from files: what is right is read, what is wrong is said."""

import json
import pickle
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from dreamdrive.errors import InputError
from dreamdrive.tasks.plan import PlannerResults, read_results
from dreamdrive.tasks.plan.recorded import results as module

PLANS = {f"token{k}": np.round(np.cumsum(np.full((6, 2), [0.01 * k, 2.5]), axis=0), 2) for k in range(4)}
Writer = Callable[[Path, dict[str, Any]], Path]


def as_json(folder: Path, plans: dict[str, Any]) -> Path:
    path = folder / "plans.json"
    path.write_text(json.dumps(plans, default=np.ndarray.tolist))
    return path


def as_pickle(folder: Path, plans: dict[str, Any]) -> Path:
    path = folder / "plans.pkl"
    path.write_bytes(pickle.dumps(plans))
    return path


def as_npz(folder: Path, plans: dict[str, Any]) -> Path:
    path = folder / "plans.npz"
    np.savez(path, **plans)
    return path


def as_table(folder: Path, plans: dict[str, Any]) -> Path:
    path = folder / "table.npz"
    np.savez_compressed(path, tokens=np.array(list(plans)), trajs=np.stack(list(plans.values())))
    return path


WRITERS = [as_json, as_pickle, as_npz, as_table]
LOOSE = [as_json, as_pickle, as_npz]


@pytest.mark.parametrize("write", WRITERS)
def test_plans_come_back(tmp_path: Path, write: Writer) -> None:
    made = read_results(write(tmp_path, PLANS))
    assert made.tokens == tuple(PLANS)
    np.testing.assert_array_equal(made.waypoints_m, np.stack(list(PLANS.values())))
    np.testing.assert_array_equal(made.plan("token2").waypoints_m, PLANS["token2"])
    with pytest.raises(InputError, match="have no sample nobody; they have 4 others"):
        made.plan("nobody")


@pytest.mark.parametrize("write", WRITERS)
def test_batches_of_one_are_plans(tmp_path: Path, write: Writer) -> None:
    made = read_results(write(tmp_path, {token: plan[None] for token, plan in PLANS.items()}))
    np.testing.assert_array_equal(made.waypoints_m, np.stack(list(PLANS.values())))


def test_lists_and_numbers_of_numpy_in_a_pickle_are_plans(tmp_path: Path) -> None:
    plans = {"a": [(np.float64(1), 2)] * 6, "b": np.ones((6, 2), np.float32), "c": [[1, 2.5]] * 6}
    made = read_results(as_pickle(tmp_path, plans))
    assert made.waypoints_m[:, 5].tolist() == [[1, 2], [1, 1], [1, 2.5]]


def with_plan(plan: Any) -> dict[str, Any]:
    return PLANS | {"odd": plan}


@pytest.mark.parametrize("write", LOOSE)
@pytest.mark.parametrize(
    ("plan", "said"),
    [
        (np.zeros((5, 2)), r"'odd' has the shape \(5, 2\); expected 6 waypoints of x and y"),
        (np.zeros((7, 2)), r"\(7, 2\); expected 6 waypoints"),
        (np.zeros((6, 3)), r"\(6, 3\)"),
        (np.zeros(12), r"\(12,\)"),
        (np.full((6, 2), 1500.0), "'odd' leads 1500 m away in three seconds; expected metres"),
    ],
    ids=["five", "seven", "three numbers", "flat", "centimetres"],
)
def test_wrong_plans_are_named(tmp_path: Path, write: Writer, plan: np.ndarray, said: str) -> None:
    with pytest.raises(InputError, match=said):
        read_results(write(tmp_path, with_plan(plan)))


@pytest.mark.parametrize("write", [as_pickle, as_npz])
@pytest.mark.parametrize("number", [np.nan, np.inf])
def test_numbers_that_are_none_are_refused(tmp_path: Path, write: Writer, number: float) -> None:
    plan = np.zeros((6, 2))
    plan[3, 1] = number
    with pytest.raises(InputError, match="'odd' holds a number that is not finite"):
        read_results(write(tmp_path, with_plan(plan)))


@pytest.mark.parametrize("number", ["NaN", "Infinity", "1e400", "1" + "0" * 400])
def test_numbers_that_are_none_in_json_are_refused(tmp_path: Path, number: str) -> None:
    path = tmp_path / "plans.json"
    path.write_text(f'{{"odd": [[1, 2], [1, 2], [1, 2], [1, 2], [1, 2], [{number}, 2]]}}')
    with pytest.raises(InputError, match=r"which is no place|not finite"):
        read_results(path)


@pytest.mark.parametrize("write", [as_json, as_pickle])
@pytest.mark.parametrize(
    "plan", ["here", [["1", "2"]] * 6, [[1, 2], [3]], None, {"x": 1}, [], [[True, False]] * 6]
)
def test_what_is_no_plan_is_refused(tmp_path: Path, write: Writer, plan: Any) -> None:
    with pytest.raises(InputError, match=r"'odd' holds no numbers in rows; expected 6 waypoints"):
        read_results(write(tmp_path, with_plan(plan)))


def test_two_entries_of_one_token_are_refused(tmp_path: Path) -> None:
    twice = tmp_path / "twice.json"
    text = as_json(tmp_path, PLANS).read_text()
    twice.write_text(text.replace("token2", "token1"))
    data = as_pickle(tmp_path, PLANS).read_bytes()
    twice.with_suffix(".pkl").write_bytes(data.replace(b"token2", b"token1"))
    np.savez(twice.with_suffix(".npz"), tokens=np.array(["token1", "token1"]), trajs=np.zeros((2, 6, 2)))
    for suffix in (".json", ".pkl", ".npz"):
        with pytest.raises(InputError, match="two entries 'token1'; expected one of each"):
            read_results(twice.with_suffix(suffix))


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("a.csv", b"", "is no file of a planner's results; expected .json, .npz, .pkl, .pickle"),
        ("a.json", b"{", "is not JSON"),
        ("a.json", b"[1, 2]", "holds a list; expected an object"),
        ("a.json", b"{}", "holds no plan"),
        ("a.json", b"[" * 100_000, "is not JSON"),
        ("a.json", b"\x81\xfe", "cannot be read as text"),
        ("a.npz", b"PK", "cannot be read as an npz"),
        ("a.pkl", pickle.dumps([1]), "holds a list; expected a dictionary"),
        ("a.pkl", pickle.dumps({1: np.zeros((6, 2))}), "keys that are no text"),
        ("a.pkl", b"", "is damaged"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, name: str, data: bytes, said: str) -> None:
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(InputError, match=said):
        read_results(path)


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    for name in ("a.json", "a.npz", "a.pkl"):
        with pytest.raises(InputError, match="cannot be read"):
            read_results(tmp_path / name)


def test_tables_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    beyond = np.full(1, 0x110000, np.uint32).view("<U1")
    for tokens, plans in (
        (np.arange(2), np.zeros((2, 6, 2))),
        (np.array(["a"]), np.zeros((2, 6, 2))),
        (np.zeros(10**6, "<U0"), np.zeros((10**6, 0))),
        (beyond, np.zeros((1, 6, 2))),
    ):
        np.savez(path, tokens=tokens, trajs=plans)
        with pytest.raises(InputError, match="expected n texts and numbers of shape"):
            read_results(path)
    np.savez(path, a=np.array([None]))
    with pytest.raises(InputError, match="cannot be read as an npz"):
        read_results(path)


def test_an_npz_of_countless_files_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_DIRECTORY_BYTES", 100)
    with pytest.raises(InputError, match="holds more files than planners' results"):
        read_results(as_npz(tmp_path, PLANS))


def test_lists_in_lists_are_looked_at_no_further_than_plans_go(tmp_path: Path) -> None:
    shared: list[Any] = [1.0] * 100
    for _ in range(2):
        shared = [shared] * 100
    begin_s = time.process_time()
    with pytest.raises(InputError, match="'odd' holds no numbers in rows"):
        read_results(as_pickle(tmp_path, with_plan(shared)))
    assert time.process_time() - begin_s < 1


def test_an_npz_that_unpacks_to_too_much_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_BYTES", 500)
    with pytest.raises(InputError, match="unpacks to over"):
        read_results(as_npz(tmp_path, PLANS))


@settings(max_examples=200)
@given(st.integers(0, 2**32), st.sampled_from(WRITERS))
def test_damaged_files_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, seed: int, write: Writer
) -> None:
    path = write(tmp_path_factory.getbasetemp(), PLANS)
    data = bytearray(path.read_bytes())
    rng = np.random.default_rng(seed)
    for _ in range(rng.integers(1, 4)):
        data[rng.integers(len(data))] = rng.integers(256)
    path.write_bytes(bytes(data[: rng.integers(len(data) // 2, len(data) + 1)]))
    try:
        read_results(path)
    except InputError as error:
        said = str(error)
    else:
        said = str(path)
    assert str(path) in said


def test_results_need_as_many_tokens_as_plans() -> None:
    with pytest.raises(ValueError, match="expected each token once"):
        PlannerResults(("a", "a"), np.zeros((2, 6, 2)))


def test_real_results_of_agent_driver(data_dir: Path, tmp_path: Path) -> None:
    folder = data_dir / "planning" / "agentdriver_nuscenes_val"
    if not folder.is_dir():
        pytest.skip(f"{folder} is not there")
    made = read_results(folder / "pred_trajs.npz")
    assert len(made) == 6019
    tokens = json.loads((folder / "val_tokens.json").read_text())
    assert set(tokens["val"]) <= set(made.tokens)
    # Text of a language model has two decimals; what was optimised has more.
    finer = np.abs(made.waypoints_m - made.waypoints_m.round(2)).max(axis=(1, 2)) > 1e-5
    assert finer.sum() == 76
    some = dict(zip(made.tokens[:300], made.waypoints_m, strict=False))
    again = read_results(as_pickle(tmp_path, some))
    np.testing.assert_array_equal(again.waypoints_m, made.waypoints_m[:300])
