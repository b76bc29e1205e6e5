"""Planned trajectories: what they are compared with, what they hit, and how they are moved away from it."""

from typing import TYPE_CHECKING

from dreamdrive.registry import offer

if TYPE_CHECKING:
    from dreamdrive.tasks.plan.agents import Agents as Agents
    from dreamdrive.tasks.plan.avoid import (
        Avoided as Avoided,
        AvoidOptions as AvoidOptions,
        avoid as avoid,
        avoid_as_uniad as avoid_as_uniad,
    )
    from dreamdrive.tasks.plan.camera_path import path_of_plan as path_of_plan, plan_of_path as plan_of_path
    from dreamdrive.tasks.plan.cost import (
        AGENT_DRIVER as AGENT_DRIVER,
        CONDITIONAL as CONDITIONAL,
        UNIAD as UNIAD,
        CollisionOptions as CollisionOptions,
        Surroundings as Surroundings,
        cost_of as cost_of,
        slopes_of as slopes_of,
    )
    from dreamdrive.tasks.plan.exact import (
        EXACT as EXACT,
        ExactOptions as ExactOptions,
        collisions as collisions,
        exact_scores as exact_scores,
    )
    from dreamdrive.tasks.plan.files import PlanResult as PlanResult, write_planned as write_planned
    from dreamdrive.tasks.plan.footprint import CAR as CAR, Footprint as Footprint, headings as headings
    from dreamdrive.tasks.plan.grid import GRID as GRID, Occupancy as Occupancy, PlanningGrid as PlanningGrid
    from dreamdrive.tasks.plan.instant import (
        CAMERA_AHEAD_M as CAMERA_AHEAD_M,
        Instant as Instant,
        instant_of as instant_of,
    )
    from dreamdrive.tasks.plan.lane_following import (
        IDM as IDM,
        IdmOptions as IdmOptions,
        Lead as Lead,
        follow_lane as follow_lane,
    )
    from dreamdrive.tasks.plan.planners import (
        constant_turn_and_acceleration as constant_turn_and_acceleration,
        constant_velocity as constant_velocity,
        stand_still as stand_still,
    )
    from dreamdrive.tasks.plan.recorded.lane_of_log import (
        centre_line_of_log as centre_line_of_log,
        lead_of_log as lead_of_log,
    )
    from dreamdrive.tasks.plan.recorded.metrics import (
        STP3_METRIC as STP3_METRIC,
        UNIAD_METRIC as UNIAD_METRIC,
        Convention as Convention,
        raster_scores as raster_scores,
    )
    from dreamdrive.tasks.plan.recorded.of_log import (
        agents_of_log as agents_of_log,
        poses_of_log as poses_of_log,
        road_users_of_log as road_users_of_log,
        truth_of_log as truth_of_log,
    )
    from dreamdrive.tasks.plan.recorded.rasters import (
        INVALID as INVALID,
        stp3_rasters as stp3_rasters,
        uniad_rasters as uniad_rasters,
    )
    from dreamdrive.tasks.plan.recorded.results import (
        PlannerResults as PlannerResults,
        read_results as read_results,
    )
    from dreamdrive.tasks.plan.recorded.scores import (
        HorizonScore as HorizonScore,
        PlanScore as PlanScore,
        Reading as Reading,
        StepScores as StepScores,
        summarise as summarise,
    )
    from dreamdrive.tasks.plan.rectangles import (
        corners as corners,
        inside as inside,
        overlapping as overlapping,
    )
    from dreamdrive.tasks.plan.trajectory import (
        AHEAD_RAD as AHEAD_RAD,
        LIDAR_AHEAD_M as LIDAR_AHEAD_M,
        STEP_S as STEP_S,
        STEPS as STEPS,
        Plan as Plan,
        ego_from_planning as ego_from_planning,
        planning_from_ego as planning_from_ego,
        planning_poses as planning_poses,
    )
    from dreamdrive.tasks.plan.uniad import (
        MovedPlans as MovedPlans,
        covered as covered,
        minimise as minimise,
        optimise_as_uniad as optimise_as_uniad,
        surroundings as surroundings,
    )

__all__ = offer(__name__)  # pyright: ignore[reportUnsupportedDunderAll]
