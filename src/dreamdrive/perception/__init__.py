"""What is around the car, seen from above, out of its cameras: Cross-View Transformers and their labels."""

from dreamdrive.perception.backbone import EfficientNetFront
from dreamdrive.perception.batch import BevBatch, BevTruth, as_truth
from dreamdrive.perception.bev_set import KIND, BevSet, PictureFormat, SampleNote, write_bev_set
from dreamdrive.perception.grid import BevGrid
from dreamdrive.perception.inputs import BevSample, as_batch, camera_from_level_ego, prepare_picture
from dreamdrive.perception.losses import LossOptions, bev_losses, focal_loss
from dreamdrive.perception.metric import THRESHOLDS, IouCounts, bev_counts, iou_counts
from dreamdrive.perception.network import Backbone, BevPrediction, CrossViewTransformer
from dreamdrive.perception.of_log import samples_of_log
from dreamdrive.perception.of_scene import PathOptions, draw_places, samples_of_scene, span_of
from dreamdrive.perception.options import QUICK, SMALL, BevClass, CvtOptions, ImageSize, Trunk
from dreamdrive.perception.raster import LAYERS, NO_VEHICLE, Annotation, BevLabels, bev_labels, flat_pose
from dreamdrive.perception.readings import Mode, Regime, Trial, read_trials, train_on
from dreamdrive.perception.sampling import Samples, shuffled
from dreamdrive.perception.schedule import ScheduleOptions, make_optimiser, set_rate
from dreamdrive.perception.scoring import Counts, pooled, score
from dreamdrive.perception.street_trunk import StreetTrunk
from dreamdrive.perception.training import WEIGHTS, CvtTraining, train_cvt
from dreamdrive.perception.weights import load_cvt, load_imagenet, load_street, save_cvt
