"""The small street network: what a picture shows, without any geometry."""

from dreamdrive.knowledge.files import KIND, write_look
from dreamdrive.knowledge.look import LookOptions, Network, look
from dreamdrive.knowledge.network import StreetNetwork
from dreamdrive.knowledge.of_clip import look_at, with_looks
from dreamdrive.knowledge.prediction import Prediction
from dreamdrive.knowledge.shipped import NO_KNOWLEDGE, SHIPPED, load_knowledge, weights_of
