"""Detection of cuts: where a recording shows another scene all at once."""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

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

_FLOW_WIDTH_PX, _FEATURE_WIDTH_PX = 160, 320
_WINDOW_PX = 9
_CONTRAST = 40.0  # standard deviation that all frames are brought to: exposure must not count
_TEXTURE = 5.0  # standard deviation inside a window, after that, from which on it can be recognised
_PICTURE, _PICTURE_SHARE = 3.0, 0.01  # the same in grey levels; a frame with less of it shows nothing
_SAME = 0.75  # correlation of two windows
_ROUND_TRIP_PX, _ROUND_TRIP_SHARE = 1.0, 0.05
_FIXED_LOOKS, _FIXED_SAME, _MOST = 8, 0.8, 0.5
_FEATURES, _FEATURE_CONTRAST, _RATIO = 800, 0.02, 0.7
_EPIPOLAR_PX, _SURE, _TRIES = 1.5, 0.999, 500

Grey = UInt8[np.ndarray, "h w"]


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


class _Likeness:
    """Compares frames of one camera, each pair once.

    What is fixed to the camera, such as a bonnet or printed time, is the same in all frames and counts for
    nothing.
    """

    def __init__(self, frames: UInt8[np.ndarray, "f h w 3"], valid: Bool[np.ndarray, "f h w"]) -> None:
        """Make small copies of frames that hold a picture where ``valid`` is set."""
        self._frames = frames
        grey = [_shrunk(frame, _FLOW_WIDTH_PX) for frame in frames]
        self._blank = [bool((_spread(g) > _PICTURE).mean() < _PICTURE_SHARE) for g in grey]
        self._small = [_even_contrast(g) for g in grey]
        usable = np.asarray(valid.all(axis=0), np.uint8)
        self._usable = cv2.resize(usable, grey[0].shape[::-1], interpolation=cv2.INTER_NEAREST) > 0
        self._usable &= ~self._fixed()
        self._flow = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_FAST)
        self.share = cache(self._share)
        self.matches = cache(self._matches)
        self.thumbnail = cache(self._thumbnail)
        self._features = cache(self._extract)

    def shows_nothing(self, frame: int) -> bool:
        """Whether there is no texture in a frame: it is black, or of one colour."""
        return self._blank[frame]

    def _thumbnail(self, frame: int) -> Float[np.ndarray, "h w"]:
        """A frame of 40 columns, in grey levels."""
        return _shrunk(self._frames[frame], _FLOW_WIDTH_PX // 4).astype(np.float64)

    def _fixed(self) -> Bool[np.ndarray, "h w"]:
        """Textured places that are the same in frames all over the clip; none if the camera stands."""
        shown = [i for i, blank in enumerate(self._blank) if not blank]
        fixed = np.zeros(self._small[0].shape, bool)
        if len(shown) < _FIXED_LOOKS:
            return fixed
        looks = [self._small[shown[i]] for i in np.linspace(0, len(shown) - 1, _FIXED_LOOKS).astype(int)]
        textured = _spread(looks[0]) > _TEXTURE
        fixed = textured & np.all([_correlation(a, b) > _FIXED_SAME for a, b in pairwise(looks)], axis=0)
        return fixed & bool(fixed.sum() < _MOST * textured.sum())

    def _share(self, first: int, second: int) -> float:
        """Share of a frame's textured pixels that optical flow finds again in another, 0 to 1.

        Found again is what correlates there, and is led back to where it came from. Pictures of two places
        have 0.00 in the median, and 0.02 or less in 99 of 100 pairs.
        """
        here, there = self._small[first], self._small[second]
        textured = self._usable & (_spread(here) > _TEXTURE)
        flow, back = self._flow.calc(here, there, None), self._flow.calc(there, here, None)  # pyright: ignore
        x, y = np.meshgrid(*(np.arange(n, dtype=np.float32) for n in here.shape[::-1]))
        x, y = x + flow[..., 0], y + flow[..., 1]
        rest = np.linalg.norm(flow + cv2.remap(back, x, y, cv2.INTER_LINEAR), axis=2)
        led_back = rest < _ROUND_TRIP_PX + _ROUND_TRIP_SHARE * np.linalg.norm(flow, axis=2)
        inside = (x >= 0) & (x <= here.shape[1] - 1) & (y >= 0) & (y <= here.shape[0] - 1)
        found = inside & led_back & (_correlation(here, cv2.remap(there, x, y, cv2.INTER_LINEAR)) > _SAME)
        return float((found & textured).sum() / max(1, textured.sum()))

    def _matches(self, first: int, second: int) -> int:
        """Number of features of two frames that one motion of the camera explains.

        Dearer than ``share``, and finds what has moved far. Of 582 pairs of pictures of two places none had
        more than 8, by chance; of frames of one drive 1 s apart 85 of 100 had.
        """
        (here, said), (there, heard) = self._features(first), self._features(second)
        if min(len(here), len(there)) < 8:
            return 0
        chosen = _mutual(said, heard)
        pair = np.flatnonzero(chosen >= 0)
        if len(pair) < 8:
            return 0
        cv2.setRNGSeed(0)
        agree = cv2.findFundamentalMat(
            here[pair], there[chosen[pair]], cv2.FM_RANSAC, _EPIPOLAR_PX, _SURE, _TRIES
        )[1]
        return 0 if agree is None else int(agree.sum())  # pyright: ignore[reportUnnecessaryComparison]

    def _extract(self, frame: int) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n d"]]:
        grey = _shrunk(self._frames[frame], _FEATURE_WIDTH_PX)
        usable = cv2.resize(self._usable.astype(np.uint8), grey.shape[::-1], interpolation=cv2.INTER_NEAREST)
        sift = cv2.SIFT.create(nfeatures=_FEATURES, contrastThreshold=_FEATURE_CONTRAST)
        found, descriptors = sift.detectAndCompute(grey, usable)
        if not found:  # the descriptors are then None
            return np.zeros((0, 2), np.float32), np.zeros((0, 128), np.float32)
        return np.array([point.pt for point in found], np.float32).reshape(-1, 2), descriptors


def find_cuts(frames: UInt8[np.ndarray, "f h w 3"], valid: Bool[np.ndarray, "f h w"]) -> Found:
    """Find changes to another scene: hard cuts, cuts by way of black, and fades of up to three frames.

    A cut is where frames of one camera, in the order of time, have nothing in common although those before it
    have much in common, and those after it. What comes back within a few frames was hidden and not cut away.
    """
    looks = _Likeness(frames, valid)
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

    def __init__(self, looks: _Likeness, shown: list[int]) -> None:
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


def _mutual(said: Float[np.ndarray, "n d"], heard: Float[np.ndarray, "m d"]) -> Int[np.ndarray, " n"]:
    """Index of the descriptor that each is clearly nearest to, and that is nearest to it; -1 for none."""
    apart = (said**2).sum(1)[:, None] + (heard**2).sum(1) - 2 * said @ heard.T
    row, best = np.arange(len(said)), apart.argmin(axis=1)
    mutual = apart.argmin(axis=0)[best] == row
    nearest = apart[row, best]
    apart[row, best] = np.inf
    return np.where(mutual & (nearest < _RATIO**2 * apart.min(axis=1)), best, -1)


def _shrunk(frame: UInt8[np.ndarray, "h w 3"], width: int) -> UInt8[np.ndarray, "h2 w2"]:
    """A frame in grey, of this width; the flow needs room, so that very flat or tall ones are stretched."""
    height = int(np.clip(round(width * frame.shape[0] / frame.shape[1]), 0.3 * width, 2 * width))
    grey = cv2.cvtColor(frame, cv2.COLOR_RGB2GRAY)
    how = cv2.INTER_AREA if width < frame.shape[1] else cv2.INTER_LINEAR
    return np.asarray(cv2.resize(grey, (width, height), interpolation=how), np.uint8)


def _even_contrast(grey: Grey) -> Grey:
    values = grey.astype(np.float32)
    values = (values - values.mean()) / (values.std() + 1e-3) * _CONTRAST + 128
    return np.clip(values, 0, 255).astype(np.uint8)


def _mean(values: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w"]:
    return cv2.blur(values, (_WINDOW_PX, _WINDOW_PX))


def _spread(grey: Grey) -> Float[np.ndarray, "h w"]:
    """Standard deviation inside the window around each pixel."""
    values = grey.astype(np.float32)
    return np.sqrt(np.maximum(_mean(values * values) - _mean(values) ** 2, 0))


def _correlation(first: Grey, second: Grey) -> Float[np.ndarray, "h w"]:
    a, b = first.astype(np.float32), second.astype(np.float32)
    mean_a, mean_b = _mean(a), _mean(b)
    spread_a = np.maximum(_mean(a * a) - mean_a**2, 0) + 1
    spread_b = np.maximum(_mean(b * b) - mean_b**2, 0) + 1
    return (_mean(a * b) - mean_a * mean_b) / np.sqrt(spread_a * spread_b)
