"""How far a view of a scene can be believed."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.trust.evidence import (
        GaussianEvidence as GaussianEvidence,
        evidence_of as evidence_of,
        rows_at as rows_at,
        seen_with as seen_with,
    )
    from dreamdrive.trust.network import (
        CALIBRATED as CALIBRATED,
        MOST as MOST,
        RISING as RISING,
        ErrorNetwork as ErrorNetwork,
        error_network as error_network,
        features_of as features_of,
    )
    from dreamdrive.trust.reach import (
        FALL_DB as FALL_DB,
        SHIFTS_M as SHIFTS_M,
        expected_db as expected_db,
        fall_m as fall_m,
        reach_m as reach_m,
    )
    from dreamdrive.trust.trust import SceneTrust as SceneTrust, TrustedView as TrustedView
    from dreamdrive.trust.within import LEAST_DB as LEAST_DB, within_trust as within_trust

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
