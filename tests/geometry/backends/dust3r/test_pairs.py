"""Which frames are paired."""

import pytest
from hypothesis import given, settings, strategies as st

from dreamdrive.errors import InputError
from dreamdrive.geometry.backends.dust3r.pairs import make_pairs, video_graph
from tests.golden.reading import values


def test_golden_pairs() -> None:
    lists = values("dust3r/pairs.json")
    assert lists
    for name, expected in lists.items():
        frames, graph, both, *prefilter = name.split("|")
        if both != "sym" or prefilter or graph.startswith("oneref"):
            continue  # what no clip needs
        # The authors' program pairs frames with themselves where a circle is as short as the window.
        expected = [pair for pair in expected if pair[0] != pair[1]]
        if not expected:
            continue  # of one frame: refused here
        got = make_pairs(int(frames), graph).tolist()
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
    half = len(pairs) // 2
    assert pairs[half:] == [(j, i) for i, j in pairs[:half]]


@settings(max_examples=30)
@given(st.integers(2, 25), st.integers(1, 25))
def test_windows(frames: int, most: int) -> None:
    apart = {abs(i - j) for i, j in make_pairs(frames, f"swin-{most}-noncyclic").tolist()}
    assert apart == {k for k in range(1, most + 1) if k < frames}
    circle = {abs(i - j) for i, j in make_pairs(frames, f"swin-{most}").tolist()}
    assert circle == {k for k in range(1, frames) if min(k, frames - k) <= most}
    powers = {abs(i - j) for i, j in make_pairs(frames, f"logwin-{most}-noncyclic").tolist()}
    assert powers == {2**k for k in range(most) if 2**k < frames}


@pytest.mark.parametrize("frames", [2, 10, 24, 25, 300])
def test_graphs_of_clips_do_not_close_and_stay_sparse(frames: int) -> None:
    pairs = make_pairs(frames, video_graph(frames))
    assert abs(pairs[:, 0] - pairs[:, 1]).max() <= 16
    assert len(pairs) < 10 * frames
    assert (abs(pairs[:, 0] - pairs[:, 1]) > 3).any() == (frames > 24)


@pytest.mark.parametrize(
    ("frames", "graph", "message"),
    [
        (1, "complete", "1 frames make no pair"),
        (5, "swim-3", "graph 'swim-3' is unknown; expected complete, swin"),
        (5, "complete-3", "is unknown"),
        (5, "swin--3", "is unknown"),
        (5, "swin-0", "at least 1"),
    ],
)
def test_other_graphs_are_refused(frames: int, graph: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make_pairs(frames, graph)
