"""How the network of the prior ``photo`` is trained: pairs from single pictures, the loop."""

from dreamdrive.prior.photo.training.loop import WEIGHTS, PhotoTraining, train_photo
from dreamdrive.prior.photo.training.pairs import FIRST_SEED, PairOptions, make_pairs, true_street
