"""Planned trajectories: what they are compared with, what they hit, and how they are moved away from it."""

from dreamdrive.plan.agents import Agents
from dreamdrive.plan.avoid import Avoided, AvoidOptions, avoid, avoid_as_uniad
from dreamdrive.plan.camera_path import path_of_plan, plan_of_path
from dreamdrive.plan.cost import (
    AGENT_DRIVER,
    CONDITIONAL,
    UNIAD,
    CollisionOptions,
    Surroundings,
    cost_of,
    slopes_of,
)
from dreamdrive.plan.exact import EXACT, ExactOptions, collisions, exact_scores
from dreamdrive.plan.footprint import CAR, Footprint, headings
from dreamdrive.plan.grid import GRID, Occupancy, PlanningGrid
from dreamdrive.plan.instant import CAMERA_AHEAD_M, Instant, instant_of
from dreamdrive.plan.lane_following import IDM, IdmOptions, Lead, follow_lane
from dreamdrive.plan.lane_of_log import centre_line_of_log, lead_of_log
from dreamdrive.plan.metrics import STP3_METRIC, UNIAD_METRIC, Convention, raster_scores
from dreamdrive.plan.occupancy import (
    CAUTIOUS,
    CELL_M,
    OCCUPANCY,
    Obstacles,
    OccupancyOptions,
    obstacles_of,
)
from dreamdrive.plan.of_log import agents_of_log, poses_of_log, road_users_of_log, truth_of_log
from dreamdrive.plan.planners import constant_turn_and_acceleration, constant_velocity, stand_still
from dreamdrive.plan.rasters import INVALID, stp3_rasters, uniad_rasters
from dreamdrive.plan.rectangles import corners, inside, overlapping
from dreamdrive.plan.results import PlannerResults, read_results
from dreamdrive.plan.scores import HorizonScore, PlanScore, Reading, StepScores, summarise
from dreamdrive.plan.trajectory import (
    AHEAD_RAD,
    LIDAR_AHEAD_M,
    STEP_S,
    STEPS,
    Plan,
    ego_from_planning,
    planning_from_ego,
    planning_poses,
)
from dreamdrive.plan.uniad import MovedPlans, covered, minimise, optimise_as_uniad, surroundings
