"""The prior ``photo``: a drive into a photo, its street in layers, with nothing downloaded."""

from dreamdrive.prior.photo.fill import grown
from dreamdrive.prior.photo.height import height_of
from dreamdrive.prior.photo.layers import Layers, layers_of
from dreamdrive.prior.photo.make import make_clip, seen_in, view
from dreamdrive.prior.photo.network import Before, PhotoNetwork, load_photo_network, mended
from dreamdrive.prior.photo.sight import Sight, sight_of
from dreamdrive.prior.photo.street import PhotoStreet
from dreamdrive.prior.photo.traffic import flowing
from dreamdrive.prior.photo.way import free_m
from dreamdrive.prior.protocol import Prior
from dreamdrive.scene.control import PhotoInput, fields_of

PHOTO = Prior(
    name="photo",
    make=make_clip,
    takes=fields_of(PhotoInput) - {"fps"},
    looks=True,
    gives="25 frames at 10 Hz with the poses, depth and sky that they were drawn from",
    about="a photo becomes a street in layers, by the street network, and is driven into",
    licence="Apache-2.0, as all of dreamdrive",
    memory="0.6 GB for 25 frames at 480x270",
)
