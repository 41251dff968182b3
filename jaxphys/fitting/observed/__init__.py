"""What was seen of a motion, and by how much a simulated one differs from it."""

from .base import Observed as Observed
from .own import Own as Own
from .pictures import Images as Images
from .pictures import Masks as Masks
from .points import Points as Points
from .tracks import Tracks as Tracks
