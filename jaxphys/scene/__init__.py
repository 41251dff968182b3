"""What a user asks for: scenes as frozen dataclasses, their JSON, PhysGaussian's configs, and
the plan.
"""

from jaxphys.mpm.boundaries import Ball as Ball
from jaxphys.mpm.boundaries import Box as Box
from jaxphys.mpm.boundaries import Capsule as Capsule
from jaxphys.mpm.boundaries import Cuboid as Cuboid
from jaxphys.mpm.boundaries import Cut as Cut
from jaxphys.mpm.boundaries import Cylinder as Cylinder
from jaxphys.mpm.boundaries import Damping as Damping
from jaxphys.mpm.boundaries import Free as Free
from jaxphys.mpm.boundaries import Impulse as Impulse
from jaxphys.mpm.boundaries import Keyframes as Keyframes
from jaxphys.mpm.boundaries import MeshObstacle as MeshObstacle
from jaxphys.mpm.boundaries import Plane as Plane
from jaxphys.mpm.boundaries import Release as Release
from jaxphys.mpm.boundaries import Rotate as Rotate
from jaxphys.mpm.boundaries import Steady as Steady
from jaxphys.mpm.boundaries import Translate as Translate
from jaxphys.mpm.boundaries import Walls as Walls
from jaxphys.mpm.meeting import Meeting as Meeting

from .json import scene_from_json as scene_from_json
from .json import to_json as to_json
from .json import write_scene as write_scene
from .physgaussian import Imported as Imported
from .physgaussian import from_physgaussian as from_physgaussian
from .physgaussian import is_physgaussian as is_physgaussian
from .read import read_scene as read_scene
from .scene import Domain as Domain
from .scene import Filling as Filling
from .scene import Generation as Generation
from .scene import Ground as Ground
from .scene import Object as Object
from .scene import Region as Region
from .scene import Rotation as Rotation
from .scene import Scene as Scene
from .view import Photograph as Photograph
from .view import View as View
