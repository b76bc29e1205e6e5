"""The focal length that the turns of the camera show: that of the network may be off in all pairs alike.

A network that believes in the focal length v instead of f gives its points, in the frame of a pair's first
camera, as diag(f/v, f/v, 1) Y of the true Y. The first pointmap then shows v, whatever f is: its pixels are v
times its slopes. The second one knows more. Let P be its points, a, t the true turn and shift from the first
to the second camera, and g a focal length to be tried:

    m(g) = g h(a diag(v/g, v/g, 1) P + t),     h(x, y, z) = (x/z, y/z)

is where the second camera sees P. For g = f these are the pixels p that P belongs to. Without a turn
m(g) = h(v P_xy + g t_xy, P_z + t_z): the shift takes g up, and nothing shows f. After a turn by an angle w
about an axis across the view, m changes by about w p^2 / g for a relative change of g.

So f, with a and t of each pair, is what brings all second pointmaps onto their own pixels. Errors along the
rays of the second camera, which are by far the greatest, do not matter for it, nor does what moves; all that
matters are errors across these rays.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial.transform import Rotation

from dreamdrive.geometry.backends.dust3r.align.focal import FocalVotes
from dreamdrive.geometry.backends.dust3r.align.graph import Graph
from dreamdrive.geometry.backends.dust3r.align.registration import pose_by_pnp
from dreamdrive.geometry.backends.dust3r.pairs import PairMaps

_SURE = 0.02  # relative; a network's own focal length counts as 0.05 off
_UNDERSTATED = 1.5  # of 26 drawn corners of ten frames; the few images that turn share their errors
_POINTS = 400  # of a pair's second image, about
_FEWEST_POINTS, _FEWEST_IMAGES = 20, 4
_NEAREST = 0.05  # of the median depth of a pair
_RANSAC_STEPS = 20
_STEPS, _LONGEST, _SETTLED = 30, 0.1, 1e-4  # of the log focal length
_FARTHEST = 0.3  # log of the ratio to the network's focal length
_CAUCHY = 2.385  # of the spread: 95 % as good as least squares where there are no outliers
_PER_MEDIAN = 0.849  # of the length of a Gaussian vector in the plane: deviation of one part of it
_ERROR = 0.01  # of the focal length, across rays: no pointmap is believed to be better
_PATCHES = 64  # in the square of an image's width: parts whose errors are independent of each other
_TINY = 1e-9
_CHUNK = 32  # pairs at a time


@dataclass(frozen=True)
class TurnedFocal:
    """Focal length fx of all images, and its relative standard deviation: infinite where nothing shows it."""

    focal_px: float
    spread: float

    @property
    def observed(self) -> bool:
        """Whether it is better than what a network believes, which is a few per cent off."""
        return self.spread <= _SURE


class _Views(NamedTuple):
    """Second pointmaps of E pairs, P points of each; what is not there weighs 0."""

    image: Int[np.ndarray, " e"]  # the second
    believed_px: Float[np.ndarray, " e"]  # focal length of the first pointmap
    pixels: Float[np.ndarray, "e p 2"]  # relative to the principal point, rows stretched
    points: Float[np.ndarray, "e p 3"]  # in the frame of the first camera, in units of their median depth
    weight: Float[np.ndarray, "e p"]  # log confidences
    patches: Float[np.ndarray, " e"]  # parts of the image whose errors are independent of each other


class _Poses(NamedTuple):
    """From the frames of E pairs to their second cameras, in the units of ``_Views``."""

    turn: Float[np.ndarray, "e 3 3"]
    shift: Float[np.ndarray, "e 3"]


class _Reduced(NamedTuple):
    """Normal equations of E pairs in the log focal length alone, their poses eliminated."""

    curvature: Float[np.ndarray, " e"]
    slope: Float[np.ndarray, " e"]  # of minus the cost
    follow: Float[np.ndarray, "e 6"]  # what a pose does when the log focal length grows by 1
    settle: Float[np.ndarray, "e 6"]  # what it does on its own
    floor: Float[np.ndarray, " e"]  # variance of the slope by errors of _ERROR


def turned_focal(maps: PairMaps, votes: FocalVotes, graph: Graph) -> TurnedFocal:
    """The focal length that brings second pointmaps onto their own pixels: Gauss-Newton under a Cauchy cost.

    The spread is the greater one of two jackknives, over images and over pairs, joined by what errors of 1 %
    of the focal length across the rays would do, were they alike over an eighth of the width and else
    independent, times what both were found to leave out. It knows nothing of an error that all turns have in
    common, nor of a network that poses its cameras by the wrong focal length as well.
    """
    nothing = TurnedFocal(votes.shared_px, float("inf"))
    found = [_view(maps, votes, graph, edge) for edge in range(len(maps))]
    found = [each for each in found if each is not None]
    if len({int(view.image[0]) for view, _ in found}) < _FEWEST_IMAGES:
        return nothing
    views, poses = _together(found)
    log_ratio = 0.0
    for _ in range(_STEPS):
        reduced = _reduced(views, poses, votes.shared_px * float(np.exp(log_ratio)))
        curvature = float(reduced.curvature.sum())
        if not curvature > _TINY:
            return nothing
        step = float(np.clip(reduced.slope.sum() / curvature, -_LONGEST, _LONGEST))
        move = reduced.settle - step * reduced.follow
        turn = Rotation.from_rotvec(move[:, :3]).as_matrix()
        poses = _Poses(turn @ poses.turn, poses.shift + move[:, 3:])
        log_ratio += step
        if abs(log_ratio) > _FARTHEST:
            return nothing
        if abs(step) < _SETTLED:
            spread = _spread(views.image, reduced)
            return TurnedFocal(votes.shared_px * float(np.exp(log_ratio)), spread)
    return nothing


def _spread(image: Int[np.ndarray, " e"], reduced: _Reduced) -> float:
    by_image = np.bincount(image, reduced.slope)
    images = len(np.unique(image))
    scatter = max(np.square(by_image).sum() * images / (images - 1), np.square(reduced.slope).sum())
    return float(_UNDERSTATED * np.sqrt(scatter + reduced.floor.sum()) / reduced.curvature.sum())


def _view(maps: PairMaps, votes: FocalVotes, graph: Graph, edge: int) -> tuple[_Views, _Poses] | None:
    """One pair on a coarse grid of its second image, with a first pose; None where it has nothing to say."""
    image, believed = int(maps.edges[edge, 1]), float(votes.focal_px[edge])
    height, width = graph.sizes[image]
    stride = max(1, round(np.sqrt(height * width / _POINTS)))
    first = stride // 2
    some = np.s_[first::stride, first::stride]
    points = maps.points[edge][1][some].astype(np.float64)
    weight = np.log(maps.confidence[edge][1][some].astype(np.float64))
    ahead = (weight > 0) & (points[..., 2] > 0)
    if np.isnan(believed) or np.count_nonzero(ahead) < _FEWEST_POINTS:
        return None
    points = np.where(ahead[..., None], points / np.median(points[ahead][:, 2]), 0)
    cx, cy = graph.principal_px[image].tolist()
    middle, stretch = ((cx - first) / stride, (cy - first) / stride), float(graph.stretch[image])
    posed = pose_by_pnp(points, ahead, believed / stride, _RANSAC_STEPS, middle, stretch)
    if posed is None:
        return None
    pose = np.linalg.inv(posed[1])
    pixels = graph.pixels(image, np.arange(height * width).reshape(height, width)[some].ravel())
    view = _Views(
        image=np.array([image]),
        believed_px=np.array([believed]),
        pixels=pixels[None],
        points=points.reshape(1, -1, 3),
        weight=np.where(ahead, weight, 0).reshape(1, -1),
        patches=np.array([max(1.0, _PATCHES * height / width)]),
    )
    return view, _Poses(pose[None, :3, :3], pose[None, :3, 3])


def _together(found: list[tuple[_Views, _Poses]]) -> tuple[_Views, _Poses]:
    """All pairs, those of smaller images filled up with points that weigh 0."""
    most = max(view.weight.shape[1] for view, _ in found)

    def filled(array: np.ndarray) -> np.ndarray:
        missing = most - array.shape[1] if array.ndim > 1 else 0
        return np.pad(array, [(0, 0), (0, missing), (0, 0)][: array.ndim])

    views = zip(*(map(filled, view) for view, _ in found), strict=True)
    poses = zip(*(pose for _, pose in found), strict=True)
    return _Views(*map(np.concatenate, views)), _Poses(*map(np.concatenate, poses))


def _reduced(views: _Views, poses: _Poses, focal_px: float) -> _Reduced:
    parts: list[_Reduced] = []
    for start in range(0, len(views.image), _CHUNK):
        some = slice(start, start + _CHUNK)
        chunk = _Views(*(each[some] for each in views)), _Poses(*(each[some] for each in poses))
        parts.append(_reduced_chunk(*chunk, focal_px))
    return _Reduced(*map(np.concatenate, zip(*parts, strict=True)))


def _reduced_chunk(views: _Views, poses: _Poses, focal_px: float) -> _Reduced:
    miss, slopes, there = _misses(views, poses, focal_px)
    length = np.where(there, np.linalg.norm(miss, axis=-1), np.inf)
    middle = np.sort(length, axis=1)[np.arange(len(length)), there.sum(axis=1) // 2]
    deviation = _PER_MEDIAN * np.where(np.isfinite(middle), middle, 1.0) + _TINY * focal_px
    floor_px = _ERROR * focal_px
    forgiven = 1 / (1 + np.square(np.where(there, length, 0) / (_CAUCHY * deviation[:, None])))
    weight = np.where(there, views.weight * forgiven, 0) / (deviation**2 + floor_px**2)[:, None]
    normal = np.einsum("ep,epai,epaj->eij", weight, slopes, slopes, optimize=True)
    right = np.einsum("ep,epai,epa->ei", weight, slopes, miss, optimize=True)
    pose, cross = normal[:, :6, :6], normal[:, :6, 6]
    damped = pose + (_TINY * np.trace(pose, axis1=1, axis2=2)[:, None, None] + _TINY) * np.eye(6)
    solved = np.linalg.solve(damped, np.stack([cross, right[:, :6]], axis=2))
    follow, settle = solved[..., 0], solved[..., 1]
    own = slopes[..., 6] - np.einsum("epai,ei->epa", slopes[..., :6], follow, optimize=True)
    alike = np.count_nonzero(weight, axis=1) / views.patches
    return _Reduced(
        curvature=normal[:, 6, 6] - (cross * follow).sum(axis=1),
        slope=right[:, 6] - (cross * settle).sum(axis=1),
        follow=follow,
        settle=settle,
        floor=alike * np.square(floor_px * weight[..., None] * own).sum(axis=(1, 2)),
    )


def _misses(
    views: _Views, poses: _Poses, focal_px: float
) -> tuple[Float[np.ndarray, "e p 2"], Float[np.ndarray, "e p 2 7"], Bool[np.ndarray, "e p"]]:
    """Pixels less m(g) of the module's text; the derivatives of m(g); where both are.

    The derivatives are by a turn (3) and a shift (3) of the points in the camera and by log g.
    """
    shape = np.ones((len(views.image), 1, 3))
    shape[:, 0, :2] = (views.believed_px / focal_px)[:, None]
    shaped = views.points * shape
    turned = shaped @ poses.turn.mT
    seen = turned + poses.shift[:, None]
    there = (views.weight > 0) & (seen[..., 2] > _NEAREST)
    depth = np.where(there, seen[..., 2], 1.0)
    plane = np.where(there[..., None], focal_px * seen[..., :2] / depth[..., None], 0)
    by_point = np.zeros((*there.shape, 2, 3))
    by_point[..., 0, 0] = by_point[..., 1, 1] = focal_px / depth
    by_point[..., 2] = -plane / depth[..., None]
    # A turn moves a point by turn x point, whose derivative is that of - point x turn.
    by_turn = np.cross(turned[..., None, :], by_point)
    flattened = (shaped * [1.0, 1.0, 0.0]) @ poses.turn.mT
    by_focal = plane - np.einsum("epai,epi->epa", by_point, flattened, optimize=True)
    slopes = np.concatenate([by_turn, by_point, by_focal[..., None]], axis=-1)
    return views.pixels - plane, np.where(there[..., None, None], slopes, 0), there
