"""Cameras, projection, tile binning, blending: splats to pictures, differentiably.

The package may be called: `jaxphys.render(...)` is `jaxphys.render.render(...)`. An imported
package is an attribute of the one around it, so that no function of this name could be beside it.
"""

import sys
from types import ModuleType
from typing import Any

from .camera import Camera as Camera
from .camera import look_at as look_at
from .camera import orbit as orbit
from .camera import position as position
from .camera import to_camera as to_camera
from .camera import to_pixels as to_pixels
from .projection import Projected as Projected
from .projection import project as project
from .projection import usable as usable
from .renderer import Image as Image
from .renderer import mean_depth as mean_depth
from .renderer import next_capacity as next_capacity
from .renderer import render as render
from .renderer import required_pairs as required_pairs
from .settings import Settings as Settings


class _Renders(ModuleType):
    def __call__(self, *arguments: Any, **options: Any) -> Image:
        return render(*arguments, **options)


sys.modules[__name__].__class__ = _Renders
