"""Which frames are paired."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.geometry.backends.dust3r.network.golden import Golden

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r.pairs import make_pairs, video_graph


def test_golden_pairs(golden_dir: Path) -> None:
    lists = Golden(golden_dir).json("pairs")
    assert len(lists) > 100
    for name, expected in lists.items():
        frames, graph, both, *prefilter = name.split("|")
        # The authors' program pairs frames with themselves where a circle is as short as the window.
        expected = [pair for pair in expected if pair[0] != pair[1]]
        got = make_pairs(
            int(frames), graph, symmetrise=both == "sym", prefilter=prefilter[0] if prefilter else None
        ).tolist()
        # Theirs of windows are sorted, for want of an order.
        assert (sorted(got) if "win" in graph else got) == expected, name


graphs = st.one_of(
    st.just("complete"),
    st.builds(
        lambda kind, k, end: f"{kind}{k}{end}",
        st.sampled_from(["swin", "logwin"]),
        st.one_of(st.just(""), st.integers(1, 200).map(lambda k: f"-{k}")),
        st.sampled_from(["", "-noncyclic"]),
    ),
    st.sampled_from(["oneref", "oneref-1"]),
)


@given(st.integers(2, 60), graphs)
def test_pairs_join_all_frames_both_ways_and_none_with_itself(frames: int, graph: str) -> None:
    pairs = [tuple(pair) for pair in make_pairs(frames, graph).tolist()]
    assert len(set(pairs)) == len(pairs)
    assert {(j, i) for i, j in pairs} == set(pairs)
    assert all(i != j and 0 <= i < frames for i, j in pairs)
    reached, new = {0}, {0}
    while new:
        new = {j for i, j in pairs if i in new} - reached
        reached |= new
    assert reached == set(range(frames))
    half = make_pairs(frames, graph, symmetrise=False).tolist()
    assert pairs[: len(half)] == [tuple(pair) for pair in half]
    assert len(pairs) == 2 * len(half)


@settings(max_examples=30)
@given(st.integers(2, 25), st.integers(1, 25))
def test_windows_and_filters(frames: int, most: int) -> None:
    window = make_pairs(frames, f"swin-{most}-noncyclic").tolist()
    assert sorted(make_pairs(frames, prefilter=f"seq{most}", graph="complete").tolist()) == sorted(window)
    circle = make_pairs(frames, f"swin-{most}").tolist()
    assert sorted(make_pairs(frames, prefilter=f"cyc{most}", graph="complete").tolist()) == sorted(circle)
    powers = make_pairs(frames, f"logwin-{most}-noncyclic", symmetrise=False)
    assert {j - i for i, j in powers.tolist()} == {2**k for k in range(most) if 2**k < frames}


@pytest.mark.parametrize("frames", [2, 10, 24, 25, 300])
def test_graphs_of_clips_do_not_close_and_stay_sparse(frames: int) -> None:
    pairs = make_pairs(frames, video_graph(frames))
    assert abs(pairs[:, 0] - pairs[:, 1]).max() <= 16
    assert len(pairs) < 10 * frames
    assert (abs(pairs[:, 0] - pairs[:, 1]) > 3).any() == (frames > 24)


@pytest.mark.parametrize(
    ("frames", "graph", "prefilter", "message"),
    [
        (1, "complete", None, "1 frames make no pair"),
        (5, "swim-3", None, "graph 'swim-3' is unknown; expected complete, swin"),
        (5, "complete-3", None, "is unknown"),
        (5, "swin--3", None, "is unknown"),
        (5, "swin-0", None, "at least 1"),
        (5, "oneref-5", None, "only frames 0 to 4"),
        (5, "complete", "seq", "prefilter 'seq' is unknown; expected seqD or cycD"),
        (5, "complete", "seq0", "leaves no pair"),
    ],
)
def test_other_graphs_are_refused(frames: int, graph: str, prefilter: str | None, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make_pairs(frames, graph, prefilter=prefilter)
