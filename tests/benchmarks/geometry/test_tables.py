"""The tables of the geometry benchmark, from rows made up."""

from typing import Any

from dreamdrive_bench.geometry import alignment_tables as tables, report


def row(method: str = "ours", **other: Any) -> dict[str, Any]:
    """An alignment."""
    return {**case(method), **figures(), **other}


def case(method: str = "ours") -> dict[str, Any]:
    noise = {"depth": 0.05, "unseen": 1.0, "mistaken": False, "common_focal": 0.0, "place": 0.0}
    told = {"frames": 25, "size": [128, 80], "graph": "swin-3-noncyclic", "noise": noise, "steps": 300}
    return {"measurement": f"align-{method}", "world": "bend a", "method": method, **told, **measured_on()}


def figures() -> dict[str, Any]:
    errors = {"path_percent": 0.5, "rpe_percent": 1.2, "focal_percent": 1.0, "abs_rel": 0.02, "delta_1": 0.99}
    told = {"path_observed": True, "focal_observed": True}
    return {**errors, **told, "edges": 138, "seconds": 10.0, "loss": 1.0}


def measured_on(**other: str) -> dict[str, Any]:
    made = {"date": "2026-01-02", "commit": "abc", "processor": "P", "torch": "2"}
    return {"measured_on": {**made, **other}}


def failed(of: dict[str, Any]) -> dict[str, Any]:
    return {**of, "failed": "ValueError: depth is not finite\nat length"}


def cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip("|").split("|")]


def by_head(table: str, number: int = 0) -> list[tuple[str, str]]:
    """Heads and cells of a line; heads come more than once."""
    head, _, *lines = table.split("\n\n")[0].splitlines()
    assert len(cells(head)) == len(cells(lines[number]))
    return list(zip(cells(head), cells(lines[number]), strict=True))


def test_targets_that_are_missed() -> None:
    assert tables.misses(row()) == []
    assert tables.misses(row(path_percent=1.5, focal_percent=3.5)) == ["path", "focal"]
    assert tables.misses(row(focal_percent=3.5, focal_observed=False)) == ["focal, as it says"]
    assert tables.misses(row(path_percent=None)) == []
    assert tables.misses(row(path_percent=float("nan"))) == ["path"]


def test_the_noise_is_named() -> None:
    usual = case()["noise"]
    assert tables.noise_words({**usual, "mistaken": True}) == "movers mistaken"
    common = {**usual, "common_focal": 0.05, "place": 0.01}
    assert tables.noise_words(common) == "focal 5 % long in all pairs, 1 % across rays"


def test_ours_stands_beside_the_authors_program() -> None:
    upstream = row("upstream", path_percent=8.0, rpe_percent=15.0, focal_percent=9.0, delta_1=0.5)
    line = by_head(tables.accuracy_table([row(path_percent=1.5), upstream]))
    ours, theirs = line[:11], line[-5:]
    assert [cell for _, cell in ours] == [
        *("bend a", "25 of 128x80", "movers where they are"),
        *("1.50", "1.20", "1.00", "0.020", "0.990", "yes", "yes", "path"),
    ]
    assert [cell for _, cell in theirs] == ["8.00", "15.00", "9.00", "0.020", "0.500"]
    assert ("RPE, %", "1.20") in ours
    assert ("< 1.25", "0.990") in ours


def test_clips_of_which_pairs_are_chosen_are_not_in_the_table_of_alignments() -> None:
    assert tables.accuracy_table([row(frames=48), row(frames=24)]) is None


def test_two_graphs_of_one_clip_leave_the_table_of_alignments_as_it_is() -> None:
    quick = [row(frames=12), row(frames=12, graph="swin-2-noncyclic")]
    assert tables.accuracy_table(quick) == tables.accuracy_table(quick[:1])
    assert len(tables.graph_tables(quick)) == 1


def test_a_few_steps_of_adam_tell_seconds_and_nothing_else() -> None:
    ours = row(tables.PAPER, seconds=20.0)
    for steps, told in ((300, ["100", "2.0000", "5.0"]), (3, ["100 (from 3 steps)", "not known", "-"])):
        adam = row("upstream", seconds=100.0, loss=2.0, steps=steps)
        line = [cell for _, cell in by_head(tables.speed_table([row(seconds=40.0), ours, adam]))]
        assert line[-4:] == [*told, "40.0"]
        errors = by_head(tables.accuracy_table([row(), ours, adam]))
        assert (errors[-1][1] == "-") == (steps == 3)


def test_no_ratio_where_ours_ends_higher() -> None:
    rows = [row(tables.PAPER, loss=3.0), row("upstream", seconds=100.0, loss=2.0)]
    assert dict(by_head(tables.speed_table(rows)))["times faster"] == "-"


def test_graphs_of_one_clip_are_a_table() -> None:
    other = row(graph="logwin-5-noncyclic", path_percent=0.2, edges=188)
    assert tables.graph_tables([row()]) == []
    ((title, text),) = tables.graph_tables([row(), other])
    assert title == "Which pairs: 25 frames"
    assert "| logwin-5-noncyclic | 188 | 0.20 | 1.00 | 10 |" in text


def test_of_several_draws_there_is_a_mean_and_a_range() -> None:
    draws = [row(draw=k, path_percent=value) for k, value in enumerate((0.3, 0.6, 0.9))]
    assert tables.graph_tables(draws) == []  # of one graph
    ((_, text),) = tables.graph_tables([*draws, row(graph="complete", path_percent=0.1)])
    assert "| swin-3-noncyclic | 138 | 0.60 (0.30 to 0.90) |" in text
    assert "| complete | 138 | 0.10 |" in text


def test_what_failed_is_not_a_dash() -> None:
    rows = [row(), row(tables.PAPER), failed(case("upstream"))]
    errors = by_head(tables.accuracy_table(rows))
    assert [cell for _, cell in errors[-5:]] == ["failed"] * 5
    assert errors[3][1] == "0.50"
    speed = dict(by_head(tables.speed_table(rows)))
    assert speed["Adam, authors' loss, s"] == "failed"
    assert speed["times faster"] == "-"
    assert dict(by_head(tables.accuracy_table([failed(case())])))["misses"] == "failed"
    ((_, text),) = tables.graph_tables([failed(case()), row(graph="complete")])
    assert "| swin-3-noncyclic | failed | failed | failed | failed |" in text
    assert report.failures(rows) == "- `align-upstream`: ValueError: depth is not finite"
    assert report.failures([row()]) is None


def test_each_kind_of_measurement_may_fail() -> None:
    ways = by_head(report.backends_table([failed({"clip": "KITTI 04", "way": "files"})]))
    assert ways[2] == ("calibrated", "failed")
    size = {"frames": 8, "size": [512, 288], "graph": "complete", "dtype": "float32", "memory_gb": 8.0}
    assert by_head(report.memory_table([failed(size)]))[-1] == ("seconds", "failed")
    assert by_head(report.scenes_table([failed({"clip": "pandaset-draft"})]))[1] == ("PSNR, dB", "failed")


def test_the_longest_curve_of_memory_comes_first() -> None:
    found = {"size": [512, 288], "edges": 1, "predicted_bytes": 1e9, "refused": "too much", "memory_gb": 8.0}
    cases = [(32, "complete", "float32"), (32, "swin-3", "float16"), (16, "swin-3", "float32")]
    cases.append((64, "swin-3", "float32"))
    rows = [{"frames": n, "graph": graph, "dtype": dtype, **found} for n, graph, dtype in cases]
    lines = report.memory_table(rows).split("\n\n")[0].splitlines()[2:]
    assert [cells(line)[0] for line in lines] == ["16", "64", "32", "32"]
    assert cells(lines[0])[6] == "refused: above 8 GB"


def test_rows_of_other_codes_and_days_are_told() -> None:
    one, other = row(), row() | measured_on(date="2026-01-04")
    assert report.origin([one, other]) == "P, torch 2, commit abc, 2026-01-02 to 2026-01-04."
    newer = row() | measured_on(commit="def")
    assert report.origin([one, newer, newer]) == (
        "Not all of one machine and code: 1 on P, torch 2, commit abc, 2026-01-02; "
        "2 on P, torch 2, commit def, 2026-01-02."
    )


def test_everything_that_was_measured_is_in_the_text() -> None:
    rows = {"Alignment": [row(), failed(case("upstream"))]}
    text = report.markdown({"wanted": 5, "measured": 1, "failed": 1, "rows": rows})
    assert "1 of 5 measurements are made, 1 failed" in text
    assert "`align` alone" in text
    assert text.index("## Alignment of noisy pairs") < text.index("## What failed")
    nothing = report.markdown({"wanted": 5, "measured": 0, "failed": 0, "rows": {}})
    assert nothing.startswith("Nothing is measured. 0 of 5")
