"""Pure step functions: Observation -> Command."""

from palpate.controllers.bumpless_transfer import BumplessTransfer
from palpate.controllers.explore import ExploreController
from palpate.controllers.explore_parameters import ExploreParameters, live_parameters
from palpate.controllers.force_guard import ForceGuard, GuardSettings
from palpate.controllers.force_law import Admittance, DirectForce, ForceLaw, VirtualBody
from palpate.controllers.force_profile import ConstantForce, ForceProfile, RampForce, SineForce
from palpate.controllers.force_program import StepForce, Tones
from palpate.controllers.gains import ForceGain, force_gain, series_stiffness, tracking_delay
from palpate.controllers.guarded_approach import Loss
from palpate.controllers.identification import Identification, MeasuredValue
from palpate.controllers.identify import IdentifyController, IdentifyParameters
from palpate.controllers.landing import LandingModel
from palpate.controllers.margins import LoopMargins
from palpate.controllers.normal_force import NormalForce
from palpate.controllers.normal_tracker import NormalTracker
from palpate.controllers.orientation import NormalAxis, Orientation
from palpate.controllers.paths.path_follower import PathFollower
from palpate.controllers.paths.polygons import Raster
from palpate.controllers.reference_force import ReferenceForce
from palpate.controllers.regulate import RegulateController
from palpate.controllers.regulate_parameters import RegulateParameters
from palpate.controllers.room import Room
from palpate.controllers.rub_program import Survey, SurveyWanted
from palpate.controllers.rubbing import RubbingController
from palpate.controllers.rubbing_parameters import RubbingParameters
from palpate.controllers.rubs import Rub
from palpate.controllers.surface_motion import (
    StiffnessRange,
    SurfaceFilter,
    SurfaceMotion,
    stiffness_range,
    surface_filter,
)
from palpate.controllers.tangent_motion import CircleMotion, SineMotion, Still, TangentMotion, VelocityTable

__all__ = [
    "Admittance",
    "BumplessTransfer",
    "CircleMotion",
    "ConstantForce",
    "DirectForce",
    "ExploreController",
    "ExploreParameters",
    "ForceGain",
    "ForceGuard",
    "ForceLaw",
    "ForceProfile",
    "GuardSettings",
    "Identification",
    "IdentifyController",
    "IdentifyParameters",
    "LandingModel",
    "LoopMargins",
    "Loss",
    "MeasuredValue",
    "NormalAxis",
    "NormalForce",
    "NormalTracker",
    "Orientation",
    "PathFollower",
    "RampForce",
    "Raster",
    "ReferenceForce",
    "RegulateController",
    "RegulateParameters",
    "Room",
    "Rub",
    "RubbingController",
    "RubbingParameters",
    "SineForce",
    "SineMotion",
    "StepForce",
    "StiffnessRange",
    "Still",
    "SurfaceFilter",
    "SurfaceMotion",
    "Survey",
    "SurveyWanted",
    "TangentMotion",
    "Tones",
    "VelocityTable",
    "VirtualBody",
    "force_gain",
    "live_parameters",
    "series_stiffness",
    "stiffness_range",
    "surface_filter",
    "tracking_delay",
]
