"""The second edition of drawn streets: far more various than the first, on hills, in every weather."""

from dreamdrive.world.edition2 import glass
from dreamdrive.world.edition2.bodies import body, size_of
from dreamdrive.world.edition2.draw import is_kept_out
from dreamdrive.world.edition2.ground import Ground2, paint_ground
from dreamdrive.world.edition2.lamps import Lamps, headlights
from dreamdrive.world.edition2.lens import bent, level_from_camera, most_barrel, pinhole, unbent
from dreamdrive.world.edition2.looks import FIRST_TRAINING_SEED, Looks
from dreamdrive.world.edition2.photograph import photograph
from dreamdrive.world.edition2.relief import Hills, hills_of
from dreamdrive.world.edition2.rider import has_rider
from dreamdrive.world.edition2.scenery import scenery
from dreamdrive.world.edition2.sky import make_sky
from dreamdrive.world.edition2.streets import draw_street
from dreamdrive.world.edition2.textures import INDEX, Texture, TextureKind, TextureLibrary
from dreamdrive.world.edition2.tiles import grain
from dreamdrive.world.edition2.weather import draw_light
