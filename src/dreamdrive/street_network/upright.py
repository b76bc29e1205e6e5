"""Detection of pictures that show a street upside down or on its side."""

import numpy as np
from jaxtyping import Float, UInt8

from dreamdrive.data.pictures.turned import turned_clip
from dreamdrive.errors import InputError
from dreamdrive.scene.clip import Clip
from dreamdrive.street_network.look import Network, look
from dreamdrive.street_network.shipped import NO_KNOWLEDGE, load_knowledge

_LOOKED_AT = 8
_SURE = 4.85
"""From here on frames are upright without a further look: turned ones of 32 recorded drives and photos have
4.83 at most."""
_STREET = 4.4
"""How sure the network is at least of what is a street once it is turned: upright ones by day reach 4.85 to
5.2, textures, noise and single colours 3.9 at most."""
_GAIN, _AGREE = 0.17, 0.75
"""What turning has to gain, and the share of the frames that it has to gain something in. Of 25 upright
drives none gains anything; of 19 recorded ones turned by half, 18 gain 0.18 to 1.05, and one, at night in
rain, 0.12. A quarter turn back gains 0.27 and more."""
_FEW, _GAIN_OF_FEW = 3, 0.25
"""The same of fewer frames than these: of 700 upright pictures one gains 0.19, the others 0.16 at most."""
HALF_TURN = 2
"""Of ``turns_to_upright``."""


def upright(clip: Clip, knowledge: str | None) -> Clip:
    """The recorded clip of one camera the right way up, with a note where it was turned.

    Nothing is said without a network, nor of cameras whose data set or mounting tells how they hang.

    Raises:
        InputError: The camera clearly lay on its side.
    """
    if knowledge in (None, NO_KNOWLEDGE) or clip.recorded is None or clip.log is not None:
        return clip
    if len(clip.rig) > 1 or clip.known.generated:
        return clip
    turns = turns_to_upright(clip.frames, load_knowledge(knowledge))
    if turns % 2:
        way = "transpose=2" if turns == 1 else "transpose=1"
        raise InputError(
            f"{clip.recorded.path}: the pictures lie on their side; expected a street the right way up: turn "
            f"them, such as with FFmpeg's filter {way}, or give --knowledge none to take them as they are"
        )
    return turned_clip(clip) if turns else clip


def turns_to_upright(frames: UInt8[np.ndarray, "f h w 3"], network: Network) -> int:
    """Quarter turns to the left after which frames clearly show a street as it stands; 0 where unclear."""
    chosen = np.unique(np.linspace(0, len(frames) - 1, min(_LOOKED_AT, len(frames))).round().astype(int))
    some = frames[chosen]
    as_is = _sureness(some, network)
    if as_is.mean() >= _SURE:
        return 0
    turned = {k: _sureness(np.rot90(some, k, axes=(1, 2)).copy(), network) for k in (HALF_TURN, 1, 3)}
    best = max(turned, key=lambda k: float(turned[k].mean()))
    gains, least = turned[best] - as_is, _GAIN if len(some) >= _FEW else _GAIN_OF_FEW
    clear = turned[best].mean() >= _STREET and gains.mean() >= least and (gains > 0).mean() >= _AGREE
    return best if clear else 0


def _sureness(frames: UInt8[np.ndarray, "f h w 3"], network: Network) -> Float[np.ndarray, " f"]:
    """How sure the network is of each frame: of its classes, and of how far the camera leans."""
    seen = look(frames, network)
    classes = seen.confidence.mean(axis=(1, 2), dtype=np.float64)
    return classes - np.log([camera.roll_spread_rad for camera in seen.cameras])
