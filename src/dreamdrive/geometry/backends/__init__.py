"""Ways of getting geometry, one each; only the table in ``geometry`` imports them."""

from dreamdrive.geometry.backends.classical import CLASSICAL
