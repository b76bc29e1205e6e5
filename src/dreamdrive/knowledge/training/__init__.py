"""How the street network is trained: records, batches, losses, the loop."""

from dreamdrive.knowledge.training.checkpoint import load_checkpoint, save_checkpoint
from dreamdrive.knowledge.training.drawn import CLASS_OF
from dreamdrive.knowledge.training.loader import LoaderOptions
from dreamdrive.knowledge.training.options import TrainingOptions
from dreamdrive.knowledge.training.street import WEIGHTS, StreetTraining, train_street
