"""Where a recording shows another scene all at once."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, UInt8

from dreamdrive.data.likeness import Likeness

SHARED, SHARED_MATCHES = 0.1, 8
"""From here on two frames show one place, or may do."""
CLOSE, CLOSE_MATCHES = 0.15, 20
"""How much neighbours of a cut must share: where they share little anyway, nothing follows from less."""
RICH_MATCHES, RICH_SHARE, RICH_LIMIT = 30, 0.5, 0.25
"""Neighbours with so many matches share more than two motorways do, whose road and sky flow alike: between
these ``SHARED`` is this part of what they share, up to the limit."""
LONGEST_FADE = 3
"""Mixed frames between two scenes."""
MIXED = 0.25
"""Part of the difference to both scenes that their mixture may leave."""
_BEFORE, _AFTER = 3, 4  # frames that are asked whether the scene comes back


@dataclass(frozen=True)
class Cut:
    """A change to another scene: the last frame before it, and the first after it."""

    last: int
    first: int


@dataclass(frozen=True)
class Found:
    """What was found in the frames of one camera, in the order of time.

    Blank frames are without any texture, such as black ones; strange ones are single and have nothing in
    common with those around them, which show one scene. If most frames have nothing in common with the next
    one they are ``apart``, so that no cut can be told.
    """

    cuts: tuple[Cut, ...] = ()
    blank: tuple[int, ...] = ()
    strange: tuple[int, ...] = ()
    apart: bool = False


def find_cuts(frames: UInt8[np.ndarray, "f h w 3"], valid: Bool[np.ndarray, "f h w"]) -> Found:
    """Find changes to another scene: hard cuts, cuts by way of black, and fades of up to three frames.

    A cut is where frames of one camera, in the order of time, have nothing in common although those before it
    have much in common, and those after it. What comes back within a few frames was hidden and not cut away.
    """
    looks = Likeness(frames, valid)
    blank = tuple(i for i in range(len(frames)) if looks.shows_nothing(i))
    shown = [i for i in range(len(frames)) if not looks.shows_nothing(i)]
    search = _Search(looks, shown)
    cuts: list[Cut] = []
    for start in range(len(shown) - 1):
        found = search.cut_behind(start)
        if found is not None and (not cuts or found.last >= cuts[-1].first):
            cuts.append(found)
    return Found(tuple(cuts), blank, search.strange(), search.apart())


class _Search:
    """Looks at the frames that show something; places count among these."""

    def __init__(self, looks: Likeness, shown: list[int]) -> None:
        self.looks, self.shown = looks, shown
        self.shares = np.array([looks.share(a, b) for a, b in pairwise(shown)])

    def cut_behind(self, start: int) -> Cut | None:
        """The change to another scene that follows a frame at once, the shortest there is."""
        for end in range(start + 1, min(len(self.shown), start + LONGEST_FADE + 2)):
            if self._is_cut(start, end):
                return Cut(self.shown[start], self.shown[end])
        return None

    def apart(self) -> bool:
        """Whether most frames have nothing in common with the next."""
        lonely = [k for k, share in enumerate(self.shares) if share < SHARED]
        if 2 * len(lonely) <= len(self.shares):
            return False
        return 2 * sum(not self._shared(k, k + 1) for k in lonely) > len(self.shares)

    def strange(self) -> tuple[int, ...]:
        """Single frames without anything in common with the frames around them."""
        return tuple(
            self.shown[k]
            for k in range(1, len(self.shown) - 1)
            if max(self.shares[k - 1 : k + 1]) < SHARED
            and self._close(k - 1, k + 1)
            and not self._shared(k - 1, k)
            and not self._shared(k, k + 1)
        )

    def _is_cut(self, start: int, end: int) -> bool:
        return (
            (end == start + 1 or self._mixed(start, end))
            and self.looks.share(self.shown[start], self.shown[end]) < self._least(start, end)
            and self._sides_agree(start, end)
            and not self._comes_back(start, end)
        )

    def _least(self, start: int, end: int) -> float:
        """The share from which on frames around a cut show one place: more where neighbours share much."""
        if self.looks.share(self.shown[start], self.shown[end]) >= RICH_LIMIT:
            return SHARED
        span, last = end - start, len(self.shown) - 1
        sides = [(start - span, start)] if start >= span else []
        sides += [(end, end + span)] if end + span <= last else []
        pairs = [(self.shown[a], self.shown[b]) for a, b in sides]
        if not pairs or min(self.looks.matches(*pair) for pair in pairs) < RICH_MATCHES:
            return SHARED
        shares = min(self.looks.share(*pair) for pair in pairs)
        return float(np.clip(RICH_SHARE * shares, SHARED, RICH_LIMIT))

    def _shared(self, first: int, second: int, least: float = SHARED) -> bool:
        a, b = self.shown[first], self.shown[second]
        return self.looks.share(a, b) >= least or self.looks.matches(a, b) >= SHARED_MATCHES

    def _close(self, first: int, second: int) -> bool:
        a, b = self.shown[first], self.shown[second]
        return self.looks.share(a, b) >= CLOSE or self.looks.matches(a, b) >= CLOSE_MATCHES

    def _sides_agree(self, start: int, end: int) -> bool:
        """Whether frames that are as far apart have much in common on both sides.

        Where one side is a single frame, the other has to answer for both, over twice the distance too.
        """
        span, last = end - start, len(self.shown) - 1
        before, after = max(0, start - span), min(last, end + span)
        if before == start:
            return self._close(end, after) and end + 2 <= last and self._close(end, min(last, end + 2 * span))
        if after == end:
            return self._close(before, start) and start >= 2 and self._close(max(0, start - 2 * span), start)
        return self._close(before, start) and self._close(end, after)

    def _comes_back(self, start: int, end: int) -> bool:
        """Whether the scene before is seen again after."""
        least = self._least(start, end)
        return any(
            self._shared(a, b, least)
            for a in range(max(0, start - _BEFORE + 1), start + 1)
            for b in range(end, min(len(self.shown), end + _AFTER))
        )

    def _mixed(self, start: int, end: int) -> bool:
        """Whether the frames between are mixtures of those at both ends, as in a fade."""
        ends = [self.looks.thumbnail(self.shown[k]) for k in (start, end)]
        return all(
            _unexplained(self.looks.thumbnail(self.shown[k]), *ends) < MIXED for k in range(start + 1, end)
        )


def _unexplained(
    frame: Float[np.ndarray, "h w"], first: Float[np.ndarray, "h w"], second: Float[np.ndarray, "h w"]
) -> float:
    """What a mixture of two frames leaves of the difference to the nearer one, as a part of it."""
    basis = np.stack([first.ravel(), second.ravel()], axis=1)
    weights = np.linalg.lstsq(basis, frame.ravel())[0]
    rest = np.square(frame.ravel() - basis @ weights).sum()
    nearer = min(np.square(frame - one).sum() for one in (first, second))
    return float(rest / max(nearer, 1e-9)) if weights.min() >= 0 else np.inf
