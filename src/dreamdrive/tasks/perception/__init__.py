"""Bird's-eye-view segmentation from a car's cameras: Cross-View Transformers and their labels."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.tasks.perception.bev_set import (
        BevSet as BevSet,
        PictureFormat as PictureFormat,
        SampleNote as SampleNote,
        cameras_of as cameras_of,
        note_of as note_of,
        write_bev_set as write_bev_set,
    )
    from dreamdrive.tasks.perception.grid import BevGrid as BevGrid
    from dreamdrive.tasks.perception.network.backbone import EfficientNetFront as EfficientNetFront
    from dreamdrive.tasks.perception.network.inputs import (
        BevSample as BevSample,
        as_batch as as_batch,
        camera_from_level_ego as camera_from_level_ego,
        prepare_picture as prepare_picture,
    )
    from dreamdrive.tasks.perception.network.network import (
        Backbone as Backbone,
        BevPrediction as BevPrediction,
        CrossViewTransformer as CrossViewTransformer,
    )
    from dreamdrive.tasks.perception.network.street_trunk import StreetTrunk as StreetTrunk
    from dreamdrive.tasks.perception.network.weights import (
        load_cvt as load_cvt,
        load_imagenet as load_imagenet,
        load_street as load_street,
        save_cvt as save_cvt,
    )
    from dreamdrive.tasks.perception.of_log import (
        annotation_of as annotation_of,
        boxes_at as boxes_at,
        in_order as in_order,
        road_map as road_map,
        samples_of_log as samples_of_log,
    )
    from dreamdrive.tasks.perception.of_scene import (
        PathOptions as PathOptions,
        draw_places as draw_places,
        samples_of_scene as samples_of_scene,
        span_of as span_of,
    )
    from dreamdrive.tasks.perception.options import (
        QUICK as QUICK,
        SMALL as SMALL,
        BevClass as BevClass,
        CvtOptions as CvtOptions,
        ImageSize as ImageSize,
        Trunk as Trunk,
    )
    from dreamdrive.tasks.perception.raster import (
        LAYERS as LAYERS,
        NO_VEHICLE as NO_VEHICLE,
        Annotation as Annotation,
        BevLabels as BevLabels,
        bev_labels as bev_labels,
        flat_pose as flat_pose,
    )
    from dreamdrive.tasks.perception.readings import (
        Experiment as Experiment,
        Mode as Mode,
        Regime as Regime,
        first_network as first_network,
        read_trials as read_trials,
        train_on as train_on,
    )
    from dreamdrive.tasks.perception.training.batch import (
        BevBatch as BevBatch,
        BevTruth as BevTruth,
        as_truth as as_truth,
    )
    from dreamdrive.tasks.perception.training.losses import (
        LossOptions as LossOptions,
        bev_losses as bev_losses,
        focal_loss as focal_loss,
    )
    from dreamdrive.tasks.perception.training.metric import (
        THRESHOLDS as THRESHOLDS,
        IouCounts as IouCounts,
        bev_counts as bev_counts,
        iou_counts as iou_counts,
    )
    from dreamdrive.tasks.perception.training.sampling import (
        Samples as Samples,
        shuffled as shuffled,
        shuffled_rows as shuffled_rows,
    )
    from dreamdrive.tasks.perception.training.schedule import (
        ScheduleOptions as ScheduleOptions,
        make_optimiser as make_optimiser,
        set_rate as set_rate,
    )
    from dreamdrive.tasks.perception.training.scoring import (
        Counts as Counts,
        pooled as pooled,
        score as score,
    )
    from dreamdrive.tasks.perception.training.training import (
        WEIGHTS as WEIGHTS,
        CvtTraining as CvtTraining,
        set_learning as set_learning,
        train_cvt as train_cvt,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
