"""Clips, random drives, and what each format says about them, written by code of its own."""

import json
from pathlib import Path

import numpy as np
from hypothesis import strategies as st

from dreamdrive.scene.camera import Camera
from dreamdrive.scene.clip import Clip, Recorded

SIZE = (40, 24)
PICTURE = (160, 96)
LENS = {"fx": 130.0, "fy": 125.0, "cx": 77.25, "cy": 50.5}


def make_clip(
    folder: Path | None,
    index: list[int],
    count: int = 6,
    picture: tuple[int, int] = PICTURE,
    scaled: tuple[int, int] = SIZE,
    offset: tuple[int, int] = (0, 0),
    name: str = "{:04d}.jpg",
    lens: dict | None = None,
) -> Clip:
    """A clip as it is read from a folder of ``count`` pictures; the pictures themselves are empty files."""
    width, height = SIZE
    recorded = None
    if folder is not None:
        folder.mkdir(exist_ok=True, parents=True)
        for i in range(count):
            (folder / name.format(i)).touch()
        recorded = Recorded(str(folder), False, picture, scaled, offset, lens)
    return Clip(
        frames=np.zeros((len(index), height, width, 3), np.uint8),
        times_s=0.1 * (np.array(index) - index[0]),
        camera=np.zeros(len(index), int),
        rig=(Camera(30.0, 30.0, width / 2, height / 2, width, height),),
        valid=np.ones((len(index), height, width), bool),
        held_out=np.zeros(len(index), bool),
        source_index=np.array(index),
        recorded=recorded,
        provenance={"notes": ["The clip's own."]},
    )


def rotation(axis_angle: tuple[float, float, float]) -> np.ndarray:
    """Rodrigues' formula."""
    x, y, z = axis_angle
    angle = float(np.sqrt(x * x + y * y + z * z))
    if angle < 1e-9:
        return np.eye(3)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) / angle
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def quaternion_wxyz(matrix: np.ndarray) -> np.ndarray:
    """Of a rotation matrix, from its eigenvector of eigenvalue 1 and its trace."""
    m = matrix
    k = np.array(
        [
            [m[0, 0] - m[1, 1] - m[2, 2], 0, 0, 0],
            [m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], 0, 0],
            [m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1], 0],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m[0, 0] + m[1, 1] + m[2, 2]],
        ]
    )
    _, vectors = np.linalg.eigh(k / 3)
    x, y, z, w = vectors[:, -1]
    return np.array([w, x, y, z])


def pose(turn: tuple[float, float, float], place: tuple[float, float, float]) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation(turn), place
    return matrix


_angle = st.floats(-3, 3)
_metre = st.floats(-200, 200)
poses = st.builds(pose, st.tuples(_angle, _angle, _angle), st.tuples(_metre, _metre, _metre))


def drives(count: int) -> st.SearchStrategy[np.ndarray]:
    """World_from_camera (F, 4, 4), axes as ours, in any world."""
    return st.lists(poses, min_size=count, max_size=count).map(np.array)


def relative(truth: np.ndarray) -> np.ndarray:
    """The poses in the frame of the first, by solving."""
    return np.linalg.solve(truth[0], truth)


def seen_points(clip: Clip, truth: np.ndarray, row: int) -> tuple[np.ndarray, np.ndarray]:
    """Points before a frame's camera in the file's world, and their pixels by the clip's camera."""
    rng = np.random.default_rng(row)
    local = rng.uniform((-3, -2, 5), (3, 2, 9), (7, 3))
    world = local @ truth[row, :3, :3].T + truth[row, :3, 3]
    assert clip.known.world_from_camera is not None
    in_clip = (world - truth[0, :3, 3]) @ truth[0, :3, :3]
    camera = clip.rig[int(clip.camera[row])].at(clip.known.world_from_camera[row])
    return world, camera.project(in_clip)[:, :2]


def write_colmap_text(
    folder: Path,
    truth: np.ndarray,
    names: list[str],
    model: str = "PINHOLE",
    numbers: list[float] | None = None,
    size: tuple[int, int] = PICTURE,
    points: np.ndarray | None = None,
) -> Path:
    """Text files as COLMAP's documentation describes them; every image sees every point."""
    folder.mkdir(parents=True, exist_ok=True)
    numbers = list(LENS.values()) if numbers is None else numbers
    camera = " ".join(map(repr, numbers))
    (folder / "cameras.txt").write_text(f"# cameras\n1 {model} {size[0]} {size[1]} {camera}\n")
    points = np.zeros((0, 3)) if points is None else points
    lines = ["# images"]
    for image, (matrix, name) in enumerate(zip(truth, names, strict=True), start=1):
        turn = matrix[:3, :3].T
        numbers = [*quaternion_wxyz(turn), *(-turn @ matrix[:3, 3])]
        lines.append(f"{image} {' '.join(repr(float(n)) for n in numbers)} 1 {name}")
        lines.append(" ".join(f"1.0 2.0 {p + 1}" for p in range(len(points))))
    (folder / "images.txt").write_text("\n".join(lines) + "\n")
    track = " ".join(f"{image} {{0}}" for image in range(1, len(truth) + 1))
    rows = [
        f"{p + 1} {x!r} {y!r} {z!r} 1 2 3 0.5 {track.format(p)}"
        for p, (x, y, z) in enumerate(points.tolist())
    ]
    (folder / "points3D.txt").write_text("\n".join(rows) + "\n")
    return folder


def transforms(truth: np.ndarray, names: list[str], **more: object) -> dict:
    """A ``transforms.json``: the camera looks along -z, its y points up."""
    frames = []
    for matrix, name in zip(truth, names, strict=True):
        turned = matrix.copy()
        turned[:, 1] = -matrix[:, 1]
        turned[:, 2] = -matrix[:, 2]
        frames.append({"file_path": name, "transform_matrix": turned.tolist()})
    lens = {"fl_x": LENS["fx"], "fl_y": LENS["fy"], "cx": LENS["cx"], "cy": LENS["cy"]}
    return {"camera_model": "PINHOLE", "w": PICTURE[0], "h": PICTURE[1], **lens, "frames": frames, **more}


def write_json(path: Path, content: object) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content))
    return path
