"""The small street network: what a picture shows, without any geometry."""

from dreamdrive.knowledge.network import StreetNetwork
from dreamdrive.knowledge.prediction import Prediction
from dreamdrive.knowledge.weights import load_network
