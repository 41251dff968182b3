"""MLS-MPM: laws, materials, boundaries, the step, rollouts and their gradients."""

from .grid import Grid as Grid
from .loop.adjoint import Checkpointed as Checkpointed
from .loop.adjoint import Plain as Plain
from .loop.frames import advance_frame as advance_frame
from .loop.frames import rollout_frames as rollout_frames
from .loop.placement import Placement as Placement
from .loop.sorting import cell_order as cell_order
from .loop.sorting import inverse_order as inverse_order
from .loop.status import SimulationError as SimulationError
from .loop.status import check as check
from .materials.catalogue import MATERIALS as MATERIALS
from .materials.catalogue import Material as Material
from .materials.catalogue import get_material as get_material
from .materials.fracture import number_of_pieces as number_of_pieces
from .materials.law import Law as Law
from .motion import Frame as Frame
from .motion import Motion as Motion
from .simulation import Simulation as Simulation
from .state import Config as Config
from .state import Model as Model
from .state import State as State
from .state import Status as Status
from .state import initial_state as initial_state
from .stepping.bounds import StepBounds as StepBounds
from .stepping.bounds import largest_stable_dt as largest_stable_dt
from .stepping.bounds import validate_dt as validate_dt
