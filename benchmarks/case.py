"""What a suite gives to the harness."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Prepared:
    """A case that is built, compiled and ready to be called.

    Attributes:
        call: does the work once and returns when it is done (device work included).
        work: units of work in one call (particle-steps, frames, ...), for ratios between methods.
        compile_seconds: time spent compiling while preparing; None for a method that does not
            compile.
        error: evaluated once after the timings; its meaning is the suite's, None where there is no
            reference.
        once: time the first call and no other: for whole runs, in which compiling counts.
        extra: anything else worth a field of the line.
        found: evaluated once after the timings, more fields that only a run can tell.
    """

    call: Callable[[], object]
    work: float
    compile_seconds: float | None = None
    error: Callable[[], float] | None = None
    once: bool = False
    extra: Mapping[str, object] = field(default_factory=dict)
    found: Callable[[], Mapping[str, object]] = dict


@dataclass(frozen=True)
class Case:
    """One method on one problem; `prepare` runs in a fresh process.

    Cases of the same `name` are run in turn, so that a drift of the machine's speed hits all of
    their methods alike. The cost of method `jaxphys` is told in units of a `baseline` of its case.
    """

    name: str
    method: str
    prepare: Callable[[], Prepared]
    size: Mapping[str, int] = field(default_factory=dict)
    dtype: str = "float32"
    rounds: int = 3
    baseline: bool = False
