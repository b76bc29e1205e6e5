"""Recordings with and without cuts, each made from frames that are at hand."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from io import BytesIO
from pathlib import Path

import av
import cv2
import numpy as np

from dreamdrive.data.source import open_source
from dreamdrive_bench.common.places import DATA

STEPS = (1, 2, 5, 10, 25)
PIECE = 10  # frames on each side of a cut
WIDTH_PX, HEIGHT_PX = 480, 270


@dataclass(frozen=True)
class Case:
    """Frames, and the index of the first one after each cut."""

    group: str
    name: str
    frames: np.ndarray
    cuts: tuple[int, ...] = ()


def drives() -> dict[str, np.ndarray]:
    """All recorded drives, 480 wide; the side cameras of PandaSet at 5 Hz."""
    folders = {}
    for clip in sorted((DATA / "clips").iterdir()):
        places = [clip / "video.mp4", clip / "frames", clip / "front_camera"]
        folders.update((clip.name, place) for place in places if place.exists())
    folders["car_park"] = DATA / "training/sully_chen/car_park"
    sides = sorted((DATA / "training/pandaset_002").glob("*_camera"))
    folders |= {f"pandaset_{side.name}": side for side in sides if any(side.glob("*.jpg"))}
    return {name: read(folder) for name, folder in folders.items()}


def photos() -> list[np.ndarray]:
    """All single pictures, cut to 16:9."""
    folders = ("osv5m", "zod", "comma10k/imgs", "sully_chen/roads", "global_streetscapes", "../photos")
    found = [file for folder in folders for file in sorted((DATA / "training" / folder).glob("*.jpg"))]
    pictures = [cv2.imread(str(file)) for file in found]
    return [widened(p[..., ::-1]) for p in pictures if 1.2 < p.shape[1] / p.shape[0] < 2.4]


def read(path: Path) -> np.ndarray:
    """All frames, 480 wide."""
    source = open_source(path)
    frames = []
    for raw in source.read(range(source.count())):
        height = 2 * round(WIDTH_PX * raw.size[1] / raw.size[0] / 2)
        frames.append(cv2.resize(raw.rgb, (WIDTH_PX, height), interpolation=cv2.INTER_AREA))
    return np.stack(frames)


def widened(picture: np.ndarray) -> np.ndarray:
    """The middle of a picture, 480x270."""
    height, width = picture.shape[:2]
    scale = max(WIDTH_PX / width, HEIGHT_PX / height)
    size = (max(WIDTH_PX, round(width * scale)), max(HEIGHT_PX, round(height * scale)))
    large = cv2.resize(np.ascontiguousarray(picture), size, interpolation=cv2.INTER_AREA)
    top, left = (size[1] - HEIGHT_PX) // 2, (size[0] - WIDTH_PX) // 2
    return large[top : top + HEIGHT_PX, left : left + WIDTH_PX]


def quiet(drives: dict[str, np.ndarray], group: str) -> Iterator[Case]:
    """Whole drives at all steps: no cut anywhere."""
    for name, frames in drives.items():
        for step in STEPS:
            if len(frames[::step]) > 1:
                yield Case(f"{group}, step {step}", name, frames[::step])


def left_out(drives: dict[str, np.ndarray]) -> Iterator[Case]:
    """Frames left out of the middle of a drive: something is still shared, or cannot be told apart."""
    for name, frames in drives.items():
        for gone in (2, 5, 10):
            if len(frames) > gone + 4:
                start = (len(frames) - gone) // 2
                rest = np.concatenate([frames[:start], frames[start + gone :]])
                yield Case(f"{gone} frames left out", name, rest)


def disturbed(drives: dict[str, np.ndarray]) -> Iterator[Case]:
    """Bad light and weather, drawn over drives; wipers, a lorry, a poor encoder: no cut anywhere."""
    for name, frames in drives.items():
        for step in (1, 3):
            part = frames[::step][:40]
            for disturbance in DISTURBANCES:
                random = np.random.default_rng(len(name))
                yield Case(f"{disturbance.__name__}, no cut", f"{name}:{step}", disturbance(part, random))


def joined(drives: dict[str, np.ndarray]) -> Iterator[Case]:
    """Every drive cut to every other one."""
    for name, first in drives.items():
        for other, second in drives.items():
            for step in STEPS:
                a, b = first[::step][-PIECE:], second[::step][:PIECE]
                if name != other and min(len(a), len(b)) > 1:
                    yield join(f"drive to drive, step {step}", f"{name} | {other}", a, b)


def at_the_ends(drives: dict[str, np.ndarray]) -> Iterator[Case]:
    """A cut after the first frame, and one before the last."""
    names = list(drives)
    for name, other in zip(names, names[1:] + names[:1], strict=True):
        for step in (1, 2, 5):
            a, b = drives[name][::step], drives[other][::step]
            yield join("cut after the first frame", f"{name} | {other}", a[-1:], b[:PIECE])
            yield join("cut before the last frame", f"{name} | {other}", a[-PIECE:], b[:1])


def apart(drives: dict[str, np.ndarray]) -> Iterator[Case]:
    """The beginning and the end of one drive."""
    for name, frames in drives.items():
        for step in (1, 2, 5):
            part = frames[::step]
            if len(part) >= 4 * PIECE:
                yield join(f"one drive, beginning to end, step {step}", name, part[:PIECE], part[-PIECE:])


def softened(drives: dict[str, np.ndarray]) -> Iterator[Case]:
    """Cuts by way of black and of mixed frames, with a bonnet, or badly encoded."""
    names = list(drives)
    for shift in (1, 4):
        for name, other in zip(names, names[shift:] + names[:shift], strict=True):
            for step in (1, 3):
                a, b = same_size(drives[name][::step][-PIECE:], drives[other][::step][:PIECE])
                label = f"{name} | {other}"
                for count in (1, 3):
                    black = np.zeros((count, *a.shape[1:]), np.uint8)
                    yield Case(
                        f"{count} black frames", label, np.concatenate([a, black, b]), (len(a) + count,)
                    )
                for count in (1, 2, 3):
                    frames = np.concatenate([a, faded(a, b, count), b])
                    yield Case(f"fade of {count} frames", label, frames, (len(a) + count,))
                both = np.concatenate([a, b])
                for disturbance in DISTURBANCES:
                    random = np.random.default_rng(len(label))
                    yield Case(f"{disturbance.__name__}, cut", label, disturbance(both, random), (len(a),))


def photo_drives(photos: list[np.ndarray], count: int = 200) -> Iterator[Case]:
    """A slow zoom into one photo, and another into a photo of another place."""
    random = np.random.default_rng(0)
    for first, second in random.integers(0, len(photos), (count, 2)):
        if first != second:
            yield join("photo to photo", f"{first} | {second}", zoom(photos[first]), zoom(photos[second]))


def zoom(photo: np.ndarray, count: int = 4) -> np.ndarray:
    """A drive towards a photo: 3 % nearer with each frame."""
    height, width = photo.shape[:2]
    frames = []
    for index in range(count):
        matrix = cv2.getRotationMatrix2D((width / 2, height / 2), 0, 1.03**index)
        frames.append(cv2.warpAffine(photo, matrix, (width, height), borderMode=cv2.BORDER_REFLECT))
    return np.stack(frames)


def join(group: str, name: str, first: np.ndarray, second: np.ndarray) -> Case:
    """Two pieces behind each other, the second one at the size of the first."""
    return Case(group, name, np.concatenate(same_size(first, second)), (len(first),))


def same_size(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both at the size of the first."""
    size = (first.shape[2], first.shape[1])
    return first, np.stack([cv2.resize(frame, size, interpolation=cv2.INTER_AREA) for frame in second])


def faded(first: np.ndarray, second: np.ndarray, count: int) -> np.ndarray:
    """Mixtures of the last and the first frame."""
    weights = (np.arange(count) + 1) / (count + 1)
    a, b = first[-1].astype(float), second[0].astype(float)
    return np.stack([(1 - w) * a + w * b for w in weights]).astype(np.uint8)


def brighter(frames: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """The second half at 0.5 times the brightness, a third of the frames at 1.5 times."""
    gains = np.where(np.arange(len(frames)) < len(frames) // 2, 1.0, 0.5)
    gains *= np.where(random.random(len(frames)) < 0.33, 1.5, 1.0)
    return np.clip(frames * gains[:, None, None, None], 0, 255).astype(np.uint8)


def tunnel(frames: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Dark within three frames, noise, and out into glare."""
    middle = len(frames) // 2
    gains = np.interp(np.arange(len(frames)) - middle, [-7, -4, 4, 4.5, 7], [1, 0.08, 0.08, 2.5, 1])
    noise = random.normal(0, 2, frames.shape)
    return np.clip(frames * gains[:, None, None, None] + noise, 0, 255).astype(np.uint8)


def night(frames: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """A sixth of the light, and noise."""
    dark = (frames / 255.0) ** 2.2 * 110
    return np.clip(dark + random.normal(0, 5, frames.shape), 0, 255).astype(np.uint8)


def rain(frames: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Less contrast, and drops that blur places of the picture, others in each frame."""
    wet = []
    for frame in frames:
        drops = (random.random(frame.shape[:2]) < 0.002).astype(np.uint8)
        drops = cv2.dilate(drops, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (9, 13)))
        blurred = cv2.GaussianBlur(frame, (0, 0), 7)
        wet.append(np.where(drops[..., None] > 0, blurred, frame) * 0.6 + 70)
    return np.stack(wet).astype(np.uint8)


def wiper(frames: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """A dark blade across every third frame."""
    height, width = frames.shape[1:3]
    wiped = frames.copy()
    for index in range(0, len(frames), 3):
        tip = (int(random.integers(0, width)), int(0.1 * height))
        picture = np.ascontiguousarray(wiped[index])
        wiped[index] = cv2.line(picture, (width // 2, height), tip, (12, 12, 12), width // 12)
    return wiped


def lorry(frames: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """A textured side that slides over nine tenths of the picture, stays for two frames and leaves."""
    height, width = frames.shape[1:3]
    coarse = random.integers(0, 256, (height // 20 + 1, width // 20 + 1, 3)).astype(np.uint8)
    side = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    passed, middle = frames.copy(), len(frames) // 4
    for index, place in enumerate((-0.6, -0.25, 0.05, 0.1, 0.45, 0.8)):
        if middle + index < len(frames):
            left, right = max(0, int(place * width)), min(width, int((place + 0.95) * width))
            passed[middle + index, : int(0.9 * height), left:right] = side[
                : int(0.9 * height), left - int(place * width) : right - int(place * width)
            ]
    return passed


def bonnet(frames: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """A textured fifth of the picture that is fixed to the camera, and printed time."""
    height, width = frames.shape[1:3]
    coarse = random.integers(0, 256, (8, 24, 3)).astype(np.uint8)
    own = cv2.resize(coarse, (width, height // 5), interpolation=cv2.INTER_CUBIC)
    dressed = frames.copy()
    dressed[:, -(height // 5) :] = own
    for frame in dressed:
        cv2.putText(frame, "2026-11-23 12:05", (8, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.6, (255, 255, 0), 2)
    return dressed


def encoded(frames: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """H.264 of poor quality."""
    buffer = BytesIO()
    height, width = (n - n % 2 for n in frames.shape[1:3])
    with av.open(buffer, "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=Fraction(10), options={"crf": "42"})
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        for frame in frames:
            picture = np.ascontiguousarray(frame[:height, :width])
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())
    buffer.seek(0)
    with av.open(buffer) as container:
        return np.stack([frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)])


Disturbance = Callable[[np.ndarray, np.random.Generator], np.ndarray]
DISTURBANCES: tuple[Disturbance, ...] = (brighter, tunnel, night, rain, wiper, lorry, bonnet, encoded)
