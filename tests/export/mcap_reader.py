"""What the MCAP project's own reader finds in a file; imported only where the packages are there."""

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from scipy.spatial.transform import Rotation

Message = Any


@dataclass(frozen=True)
class Recording:
    """Messages by topic, each with its time in nanoseconds, and the names of their schemas."""

    messages: dict[str, list[tuple[int, Message]]]
    schemas: dict[str, str]
    facts: dict[str, str]

    def at(self, topic: str, time_ns: int) -> Message:
        """The one message of a topic at a time."""
        (found,) = [message for when, message in self.messages[topic] if when == time_ns]
        return found

    def times(self, topic: str) -> list[int]:
        return [when for when, _ in self.messages[topic]]


def read(file: Path) -> Recording:
    messages: dict[str, list[tuple[int, Message]]] = defaultdict(list)
    schemas: dict[str, str] = {}
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            decode = DecoderFactory().decoder_for(channel.message_encoding, schema)
            messages[channel.topic].append(
                (message.log_time, decode(message.data) if decode else message.data)
            )
            schemas[channel.topic] = schema.name
        summary, facts = reader.get_summary(), [each.metadata for each in reader.iter_metadata()]
    assert summary.statistics.message_count == sum(map(len, messages.values()))
    assert all(
        sorted(each) == each for each in (list(when for when, _ in rows) for rows in messages.values())
    )
    return Recording(dict(messages), schemas, facts[0] if facts else {})


def pose_of(pose: Message) -> np.ndarray:
    """The matrix of a pose or a frame transform."""
    place, turn = (
        (pose.translation, pose.rotation)
        if hasattr(pose, "translation")
        else (pose.position, pose.orientation)
    )
    found = np.eye(4)
    found[:3, :3] = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
    found[:3, 3] = place.x, place.y, place.z
    return found


def placed(recording: Recording, time_ns: int, frame: str) -> np.ndarray:
    """Where a frame was in the map, from the one message of that time."""
    told = {each.child_frame_id: each for each in recording.at("/tf", time_ns).transforms}
    assert all((each.timestamp.ToNanoseconds()) == time_ns for each in told.values())
    found = np.eye(4)
    while frame != "map":
        found, frame = pose_of(told[frame]) @ found, told[frame].parent_frame_id
    return found


def picture_of(message: Message) -> np.ndarray:
    """Red, green and blue of a compressed image."""
    flags = cv2.IMREAD_COLOR
    return cv2.imdecode(np.frombuffer(message.data, np.uint8), flags)[..., ::-1]


def points_of(message: Message) -> np.ndarray:
    """Points of a cloud in its frame, by its own fields."""
    assert [(each.name, each.type) for each in message.fields] == [("x", 7), ("y", 7), ("z", 7)]
    kind = np.dtype(
        {
            "names": [each.name for each in message.fields],
            "formats": ["<f4"] * 3,
            "offsets": [each.offset for each in message.fields],
            "itemsize": message.point_stride,
        }
    )
    rows = np.frombuffer(message.data, kind)
    local = np.column_stack([rows[axis] for axis in "xyz"]).astype(np.float64)
    pose = pose_of(message.pose)
    return local @ pose[:3, :3].T + pose[:3, 3]
