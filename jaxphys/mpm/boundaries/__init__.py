"""Boundaries: what happens at walls, floors and chosen regions. One class a boundary, in a file of
its own; `AnyBoundary` lists them for whoever reads scenes.
"""

from .ball import Ball as Ball
from .base import FOREVER as FOREVER
from .base import Boundary as Boundary
from .base import Setting as Setting
from .base import Vector as Vector
from .box import Box as Box
from .capsule import Capsule as Capsule
from .contact import Contact as Contact
from .cuboid import Cuboid as Cuboid
from .cut import Cut as Cut
from .cylinder import Cylinder as Cylinder
from .damping import Damping as Damping
from .free import Free as Free
from .free import Solid as Solid
from .impulse import Impulse as Impulse
from .mesh_obstacle import MeshObstacle as MeshObstacle
from .mesh_obstacle import Samples as Samples
from .motion import Keyframes as Keyframes
from .motion import Steady as Steady
from .obstacle import Obstacle as Obstacle
from .plane import Plane as Plane
from .release import Release as Release
from .rotate import Rotate as Rotate
from .stages import prepare as prepare
from .translate import Translate as Translate
from .walls import Walls as Walls

AnyObstacle = Ball | Cuboid | Cylinder | Capsule | MeshObstacle
AnyBoundary = (
    Walls | Plane | Box | AnyObstacle | Impulse | Translate | Rotate | Release | Cut | Damping
)
