"""What two frames of a clip have in common: how much of one is found again in the other."""

from functools import cache
from itertools import pairwise

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

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


class Likeness:
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
