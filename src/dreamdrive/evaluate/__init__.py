"""How good results are: figures with their sample counts, floors and intervals."""

from dreamdrive.evaluate.actor_boxes import BoxError
from dreamdrive.evaluate.consistency import Consistency, evaluate_consistency
from dreamdrive.evaluate.decomposition import Decomposition, evaluate_decomposition
from dreamdrive.evaluate.estimate import Estimate
from dreamdrive.evaluate.extractors import WeightFiles
from dreamdrive.evaluate.geometry import DepthFigures, GeometryFigures, evaluate_geometry
from dreamdrive.evaluate.geometry_truth import GeometryTruth, read_geometry_truth
from dreamdrive.evaluate.paths import compare_paths
from dreamdrive.evaluate.retrieval import Retrieval, retrieval
from dreamdrive.evaluate.truth import Truth, read_truth
from dreamdrive.evaluate.video import VideoReport, VideoSettings, evaluate_video
