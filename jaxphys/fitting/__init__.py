"""From how something moved to what it is made of, how it was thrown, and how sure that is."""

from .evaluation import Evaluator as Evaluator
from .evaluation import Memory as Memory
from .fit import Stage as Stage
from .fit import fit as fit
from .fit import solved as solved
from .free import Angle as Angle
from .free import Bounded as Bounded
from .free import Field as Field
from .free import Free as Free
from .free import Log as Log
from .free import Softplus as Softplus
from .layout import layout as layout
from .motion import motion_at as motion_at
from .observed import Images as Images
from .observed import Masks as Masks
from .observed import Observed as Observed
from .observed import Own as Own
from .observed import Points as Points
from .observed import Tracks as Tracks
from .problem import Problem as Problem
from .problem import problem as problem
from .result import Fit as Fit
from .search import LBFGS as LBFGS
from .search import Adam as Adam
from .search import GaussNewton as GaussNewton
from .uncertainty import Uncertainty as Uncertainty
