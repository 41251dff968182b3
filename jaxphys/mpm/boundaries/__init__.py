"""Boundaries: what happens at walls, floors and chosen regions. One class a boundary, in a file of
its own; `AnyBoundary` lists them for whoever reads scenes.
"""

from .base import FOREVER as FOREVER
from .base import Boundary as Boundary
from .base import Setting as Setting
from .base import Vector as Vector
from .box import Box as Box
from .contact import Contact as Contact
from .cut import Cut as Cut
from .damping import Damping as Damping
from .impulse import Impulse as Impulse
from .plane import Plane as Plane
from .release import Release as Release
from .rotate import Rotate as Rotate
from .stages import prepare as prepare
from .translate import Translate as Translate
from .walls import Walls as Walls

AnyBoundary = Walls | Plane | Box | Impulse | Translate | Rotate | Release | Cut | Damping
