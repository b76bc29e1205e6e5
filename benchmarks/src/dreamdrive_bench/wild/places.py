"""The places of a manifest: photos, views out of panoramas, and what is asked of them."""

from pathlib import Path
from typing import Annotated

import msgspec

_NAME = r"^[A-Za-z0-9][A-Za-z0-9._-]*$"


class Place(msgspec.Struct, forbid_unknown_fields=True):
    """One place: a file beside the manifest, and what is known of it.

    Attributes:
        name: Of its folder.
        file: The photo, or the panorama.
        view: Heading and pitch of what is taken out of a panorama, in degrees.
        hfov_deg: Horizontal field of view, of the photo or of what is taken out.
        camera_height_m: Height of the camera above the road.
        actions: What is driven, each a drive of its own; straight ahead without.
    """

    name: Annotated[str, msgspec.Meta(pattern=_NAME)]
    file: str
    view: tuple[float, float] | None = None
    hfov_deg: float | None = None
    camera_height_m: float | None = None
    actions: tuple[str, ...] = ()


def read_places(manifest: Path) -> list[tuple[Place, Path]]:
    """The places of a manifest with their files, which have to be there."""
    places = msgspec.json.decode(manifest.read_bytes(), type=list[Place])
    found = [(place, (manifest.parent / place.file).resolve()) for place in places]
    if missing := [str(path) for _, path in found if not path.is_file()]:
        raise SystemExit(f"{manifest} names files that are not there: {', '.join(missing)}")
    if len({place.name for place in places}) < len(places):
        raise SystemExit(f"{manifest}: two places have one name")
    return found


def photos_of(folder: Path) -> list[tuple[Place, Path]]:
    """All photos of a folder, of which nothing is known."""
    return [(Place(path.stem, path.name), path) for path in sorted(folder.glob("*.jpg"))]
