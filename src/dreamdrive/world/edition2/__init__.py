"""The second edition of drawn streets: far more various, to train networks on."""

from dreamdrive.world.edition2.bodies import body, size_of
from dreamdrive.world.edition2.draw import is_kept_out
from dreamdrive.world.edition2.rider import has_rider
