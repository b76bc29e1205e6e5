"""Remarks on the frames of a recording: cuts, gaps, damage."""

import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import PurePath

import numpy as np
from jaxtyping import Float, Int

from dreamdrive.data.frames.cuts import Cut, Found

_JUMP = 2.5
"""Part of the usual step from which on a longer one is worth a note."""
_NAMED, _PIECES = 4, 3
"""Runs of frames, and pieces between cuts, that a sentence names at most."""


def runs(numbers: Sequence[int]) -> str:
    """Rising numbers in words, such as "3, 7 to 9 and 12"; after the first few, "and 20 more"."""
    bounds: list[list[int]] = []
    for number in numbers:
        if bounds and number == bounds[-1][1] + 1:
            bounds[-1][1] = number
        else:
            bounds.append([number, number])
    words = [
        str(a) if a == b else f"{a} and {b}" if b == a + 1 and len(bounds) == 1 else f"{a} to {b}"
        for a, b in bounds[:_NAMED]
    ]
    more = sum(b - a + 1 for a, b in bounds[_NAMED:])
    return listed([*words, f"{more} more"] if more else words)


def listed(words: Sequence[str], last: str = "and") -> str:
    """The words as "a, b and c"."""
    return f" {last} ".join(([", ".join(words[:-1])] if words[1:] else []) + list(words[-1:]))


def of_damage(index: Sequence[int]) -> list[str]:
    """The sentence about frames that the decoder patched up."""
    if not index:
        return []
    which = (
        f"Frames {runs(index)} of the video are" if len(index) > 1 else f"Frame {index[0]} of the video is"
    )
    upon = "damaged ones" if len(index) > 1 else "a damaged one"
    return [f"{which} damaged, or built upon {upon}, and patched up by the decoder."]


def of_cuts(found: Found, index: Int[np.ndarray, " f"]) -> list[str]:
    """The sentences about cuts, blank frames and frames of something else, by their index in the source."""
    notes: list[str] = []
    if found.cuts:
        notes.append(_of_cuts(found.cuts, index))
    if found.apart:
        notes.append(
            "Most frames have nothing in common with the next one, and no motion can be seen between them; "
            "choose a smaller step with --frames if this is one drive."
        )
    if len(found.blank) == len(index):
        notes.append("No frame shows anything that could be recognised.")
    elif found.blank:
        which = runs(index[list(found.blank)].tolist())
        notes.append(f"{_frames(found.blank, which, 'shows', 'show')} nothing that could be recognised.")
    if found.strange:
        which = runs(index[list(found.strange)].tolist())
        what = "has", "have"
        notes.append(
            f"{_frames(found.strange, which, *what)} nothing in common with the frames before and after."
        )
    return notes


def of_missing_images(files: Sequence[PurePath]) -> list[str]:
    """The sentence about numbers that the names of images leave out; a regular step leaves out none."""
    found = [re.findall(r"\d+", file.stem) for file in files]
    if len(files) < 3 or not all(found):
        return []
    numbers = np.array([int(each[-1][-18:]) for each in found])
    steps = np.diff(numbers)
    usual = int(np.median(steps))
    # Names that are times, or number several things, are not evenly spaced at all.
    if usual < 1 or (steps % usual).any() or (steps < 1).any() or np.mean(steps == usual) < 0.5:
        return []
    gaps = [(int(a), int(b)) for a, b in pairwise(numbers) if b - a > usual]
    if not gaps:
        return []
    count = sum((b - a) // usual - 1 for a, b in gaps)
    missing = [n for a, b in gaps[: _NAMED + 1] for n in range(a + usual, min(b, a + 1000 * usual), usual)]
    which = runs(missing) if usual == 1 and count == len(missing) else _between(gaps)
    return [
        f"The images are numbered in steps of {usual}, and leave out {which}: they count as evenly spaced in "
        "time all the same."
    ]


def of_time_jumps(index: Int[np.ndarray, " f"], times_s: Float[np.ndarray, " f"]) -> list[str]:
    """The sentence about steps in time, by the recording's own clock, that are far longer than the others."""
    steps_s = np.diff(times_s)
    if len(steps_s) < 3:
        return []
    usual_s = float(np.median(steps_s))
    after = np.flatnonzero(steps_s > _JUMP * usual_s).tolist()
    if not after:
        return []
    said = [f"{steps_s[k]:.2g} s between frames {index[k]} and {index[k + 1]}" for k in after[:_NAMED]]
    more = [f"at {len(after) - _NAMED} more places"] if len(after) > _NAMED else []
    return [
        f"The recording's times jump, by {listed([*said, *more])}; elsewhere a step takes {usual_s:.2g} s."
    ]


def _of_cuts(cuts: tuple[Cut, ...], index: Int[np.ndarray, " f"]) -> str:
    """Where the cuts are, and what to select instead, the longest piece first."""
    starts = [0, *(cut.first for cut in cuts)]
    ends = [*(cut.last for cut in cuts), len(index) - 1]
    pieces = sorted(zip(starts, ends, strict=True), key=lambda piece: piece[0] - piece[1])
    step = int(np.diff(index).min())
    choices = [f"{index[a]}:{index[b] + 1}:{step}" for a, b in pieces if b > a]
    at = [int(index[cut.first]) for cut in cuts]
    where = f"frame {at[0]}" if len(at) == 1 else f"frames {runs(at)}"
    advice = f"; --frames {listed(choices[:_PIECES], 'or')} keeps to one" if choices else ""
    return f"The picture cuts to another scene at {where} of the source{advice}."


def _frames(which: Sequence[int], words: str, one: str, many: str) -> str:
    return f"Frames {words} of the source {many}" if len(which) > 1 else f"Frame {words} of the source {one}"


def _between(gaps: Sequence[tuple[int, int]]) -> str:
    """Gaps by the numbers beside them."""
    said = [f"those between {a} and {b}" for a, b in gaps[:_NAMED]]
    return listed([*said, f"{len(gaps) - _NAMED} more gaps"] if len(gaps) > _NAMED else said)
