"""The calibration of a data set's camera, held against the pictures that lie on disk."""

from dreamdrive.scene.camera import Camera

_ASPECT_TOLERANCE = 0.005
_OFF_MIDDLE = 0.25
"""Part of width and height by which a principal point may lie off the middle: pictures may be cut, but one
that is off by a half is that of pictures of another size."""


def fitted(pinhole: Camera, size: tuple[int, int], problems: list[str], where: str) -> Camera:
    """The pinhole at the size (width, height) of the pictures; that it was scaled joins the problems.

    Raises:
        ValueError: The pictures have another shape.
    """
    told = pinhole.width_px, pinhole.height_px
    sizes = f"{size[0]}x{size[1]}", f"{told[0]}x{told[1]}"
    if size == told:
        return pinhole
    if abs(size[0] / size[1] * told[1] / told[0] - 1) > _ASPECT_TOLERANCE:
        raise ValueError(f"it is for {sizes[1]}, but pictures are {sizes[0]}, another shape")
    problems.append(f"{where}: pictures are {sizes[0]}, not {sizes[1]} as told: the calibration is scaled")
    return pinhole.resized(*size)


def check_middle(pinhole: Camera) -> None:
    """Refuse a calibration without a size that is not of pictures of the pinhole's size.

    Raises:
        ValueError: The principal point lies far off the middle of the pictures.
    """
    x, y = pinhole.cx_px / pinhole.width_px, pinhole.cy_px / pinhole.height_px
    if max(abs(x - 0.5), abs(y - 0.5)) > _OFF_MIDDLE:
        raise ValueError(
            f"its principal point, {pinhole.cx_px:.0f}, {pinhole.cy_px:.0f}, is not that of pictures of "
            f"{pinhole.width_px}x{pinhole.height_px}; scale the calibration as the pictures were"
        )
