from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from dreamdrive.errors import InputError
from dreamdrive_train.street_network.data.mixture import Entry, Mixture, read_entries, split
from dreamdrive_train.street_network.data.records import Record, write_records


def entry(source: str, name: str, *, weight: float = 1.0, kept_out: bool = False) -> Entry:
    record = Record(image=name, source=source, group=name, weight=weight, kept_out=kept_out)
    return Entry(Path(), record)


def counts(mixture: Mixture, batches: int = 400) -> Counter[str]:
    generator = np.random.default_rng(0)
    return Counter(each.record.image for _ in range(batches) for each in mixture.draw(4, generator))


def test_sources_and_records_by_their_weights() -> None:
    entries = [entry("drawn", "a"), entry("drawn", "b", weight=3), entry("real", "c")]
    found = counts(Mixture.of(entries, {"drawn": 3.0}))
    assert found["c"] == 400  # one in each batch of four
    assert found["b"] / found["a"] == pytest.approx(3, rel=0.2)


def test_each_batch_mixes_the_sources() -> None:
    mixture = Mixture.of([entry("drawn", "a"), entry("real", "b")], {})
    generator = np.random.default_rng(1)
    for _ in range(20):
        assert Counter(each.record.image for each in mixture.draw(4, generator)) == {"a": 2, "b": 2}


@pytest.mark.parametrize("weights", [{"other": 1.0}, {"drawn": 0.0}, {"drawn": -1.0}])
def test_weights_that_leave_nothing_are_refused(weights: dict[str, float]) -> None:
    with pytest.raises(InputError, match=r"no record is of other|nothing is drawn"):
        Mixture.of([entry("drawn", "a")], weights)


def test_a_group_on_both_sides_is_refused() -> None:
    with pytest.raises(InputError, match="kept out and trained on"):
        split([entry("real", "a"), entry("real", "a", kept_out=True)])
    taken, kept_out = split([entry("real", "a"), entry("real", "b", kept_out=True)], [entry("other", "a")])
    assert [len(taken), len(kept_out)] == [1, 2]


def test_records_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"records\.jsonl cannot be read"):
        read_entries([tmp_path])
    fine = b'{"image": "a.png", "source": "s", "group": "g", "weight": 1e300}'
    for line in (b'{"image": 3}', b'{"image": "\xff"}', b"[" * 100_000, fine):
        (tmp_path / "records.jsonl").write_bytes(line + b"\n")
        with pytest.raises(InputError, match="one record a line"):
            read_entries([tmp_path])
    write_records([Record(image="a.png", source="s", group="g")], tmp_path)
    assert read_entries([tmp_path])[0].record.image == "a.png"
