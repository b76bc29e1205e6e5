"""Options of the training of the street network."""

from dataclasses import dataclass, field

from dreamdrive_train.street_network.data.loader import LoaderOptions
from dreamdrive_train.street_network.losses import StreetLossOptions


@dataclass(frozen=True)
class TrainingOptions:
    """Length and rates of a training."""

    steps: int = 20_000
    seed: int = 0
    rate: float = 2e-3
    """AdamW's step at its largest."""
    encoder_rate: float = 0.25
    """The encoder's step in shares of it: it starts from ImageNet."""
    weight_decay: float = 0.02
    warm_up: float = 0.03
    """Share of the steps over which the rates rise; then they fall as a cosine to 0."""
    clip: float = 5.0
    """Largest norm of the gradient."""
    average: float = 0.999
    """Share of the averaged weights that a step keeps; they are what is judged and written."""
    teach_from: float = 0.15
    """Share of the steps after which the averaged network teaches, in full after twice as many."""
    frozen_blocks: int = 0
    """Blocks of the encoder, from the first, that stay as they are."""
    filters: bool = False
    """Whether the encoder's filters of single channels are learned, too: half of a step goes into them."""
    low_precision: bool = True
    """Convolutions in bfloat16."""
    validate_each: int = 1000
    """Steps between two judgements."""
    log_each: int = 20
    """Steps whose losses make one line."""
    checkpoint_s: float = 600.0
    """Seconds between two checkpoints."""
    loader: LoaderOptions = field(default_factory=LoaderOptions)
    losses: StreetLossOptions = field(default_factory=StreetLossOptions)
