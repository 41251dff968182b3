"""Which times a simulation steps to. A stepping is a frozen value; `loop` has the loop of each."""

from .adaptive import Adaptive as Adaptive
from .fixed import Fixed as Fixed
from .implicit import Implicit as Implicit

Stepping = Fixed | Adaptive | Implicit
