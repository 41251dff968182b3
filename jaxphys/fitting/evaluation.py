"""Evaluations of a problem on the host, remembered, so that a search that was killed goes on.

A search is a deterministic function of what it evaluates. It is therefore enough to keep what was
evaluated: run again, it asks the same questions in the same order, gets the first ones answered
from memory, and goes on where it was, to the same bytes.
"""

import time
from collections.abc import Callable
from typing import Any

import jax
import numpy as np

from jaxphys.core.checkpoints import Checkpoints
from jaxphys.fitting.motion import TooManySteps
from jaxphys.fitting.problem import Problem, Program
from jaxphys.mpm.state import NOT_FINITE, OK, STEP_TOO_LARGE, UNSTABLE_STEP

EVERY = 15.0  # seconds between savings, at least
SHORTER = {NOT_FINITE, STEP_TOO_LARGE, UNSTABLE_STEP}  # failures that shorter steps may avoid
MOST_DOUBLED = 4  # times the steps that the bounds ask for
KINDS = ("loss", "gradient", "normal")


class Memory:
    """What was evaluated, in order. With `checkpoints` it outlives the process.

    Attributes:
        replayed: how many answers came out of it.
    """

    def __init__(self, checkpoints: Checkpoints | None = None):
        self._checkpoints = checkpoints
        self._rows: list[dict[str, np.ndarray]] = []
        self._next, self._saved = 0, time.monotonic()
        found = checkpoints.newest() if checkpoints else None
        if found is not None:
            count, arrays = found
            fields = {name.partition("/")[0] for name in arrays}
            self._rows = [
                {name: arrays[f"{name}/{i}"] for name in fields if f"{name}/{i}" in arrays}
                for i in range(count)
            ]
        self.replayed = 0

    def recall(self, kind: str, vector: np.ndarray, frames: int) -> dict | None:
        """The answer to the next question, if it was asked before."""
        if self._next < len(self._rows):
            row = self._rows[self._next]
            asked = KINDS[int(row["kind"])], int(row["frames"])
            if asked == (kind, frames) and np.array_equal(row["vector"], vector):
                self._next += 1
                self.replayed += 1
                return row
            del self._rows[self._next :]  # of another search
        return None

    def keep(self, kind: str, vector: np.ndarray, frames: int, **answer) -> None:
        """Remembers an answer."""
        row = {name: np.asarray(value) for name, value in answer.items()}
        row |= {"kind": np.asarray(KINDS.index(kind)), "frames": np.asarray(frames)}
        self._rows.append(row | {"vector": np.array(vector)})
        self._next += 1
        if time.monotonic() - self._saved > EVERY:
            self.save()

    def save(self) -> None:
        """Writes what is new."""
        if self._checkpoints is None or self._next == 0:
            return
        rows = self._rows[: self._next]
        arrays = {f"{name}/{i}": v for i, row in enumerate(rows) for name, v in row.items()}
        self._checkpoints.save(len(rows), arrays)
        self._saved = time.monotonic()


class Evaluator:
    """A problem's loss and its derivatives at vectors, for a search on the host.

    Programs are compiled once; that of a reverse derivative once for each number of steps.

    Args:
        problem: what is evaluated.
        memory: asked first.
        watch: called after each evaluation; may raise KeyboardInterrupt.
    """

    def __init__(self, problem: Problem, memory: Memory, watch: Callable[[], None] | None = None):
        self.problem = problem
        self.memory = memory
        self._watch = watch or (lambda: None)
        self._data: tuple | None = None
        self._match: np.ndarray | None = None
        self._program: Program | None = None

    def match(self, vector: np.ndarray) -> None:
        """Finds neighbours again, as the motion at `vector` has them, before the next answer that
        is computed.
        """
        self._match = np.array(vector)

    def loss(self, vector: np.ndarray, frames: int) -> float:
        """The loss, infinite where the simulation fails."""
        return self._evaluated("loss", vector, frames)[0]

    def gradient(self, vector: np.ndarray, frames: int) -> tuple[float, np.ndarray]:
        """(loss, gradient (P,)); the gradient is zero where the loss is infinite."""
        loss, slope, _ = self._evaluated("gradient", vector, frames)
        return loss, slope

    def normal(self, vector: np.ndarray, frames: int) -> tuple[float, np.ndarray, np.ndarray]:
        """(loss, J^T r (P,), J^T J (P, P))."""
        return self._evaluated("normal", vector, frames)

    def program(self, vector: np.ndarray) -> Program:
        """The program for a vector."""
        self._program = self.problem.program(vector, self._program)
        return self._program

    def data(self) -> tuple:
        """What was observed, with neighbours as they were last found."""
        if self._data is None:
            self._data = self.problem.data()
        if self._match is not None:
            program = self.program(self._match)
            self._data = self.problem.matched(self._match, self._data, program)
            self._match = None
        return self._data

    def _evaluated(self, kind: str, vector: np.ndarray, frames: int) -> tuple[float, Any, Any]:
        size = len(vector)
        row = self.memory.recall(kind, vector, frames)
        if row is None:
            answer = self._computed(kind, vector, frames)
            if self._program is not None:
                answer["program"] = np.array([self._program.steps, *self._program.capacities])
            self.memory.keep(kind, vector, frames, **answer)
            row = {name: np.asarray(value) for name, value in answer.items()}
            self._watch()
        elif "program" in row:
            # What a trial takes depends on the program before it: the same as if asked again.
            steps, *capacities = (int(n) for n in row["program"])
            self._program = Program(steps, tuple(capacities))
        loss = float(row["loss"])
        slope = row.get("slope", np.zeros(size))
        return loss, slope, row.get("gram", np.zeros((size, size)))

    def _computed(self, kind: str, vector: np.ndarray, frames: int) -> dict[str, Any]:
        failed: dict[str, Any] = {"loss": np.float64(np.inf)}
        if kind != "loss":
            failed["slope"] = np.zeros(len(vector))
        data = self.data()
        try:
            program = self.program(vector)
        except TooManySteps:
            if self._program is None:
                raise  # where the fit starts
            return failed
        while True:
            if kind == "loss":
                parts = (self.problem.compare(vector, data, frames, program).loss,)
            else:
                function = self.problem.call(kind, program)
                parts = jax.device_get(function(self.problem.cast(vector), data, frames))
            if np.isfinite(parts[0]):
                names = ("loss", "slope", "gram")
                return {n: np.asarray(p, np.float64) for n, p in zip(names, parts, strict=False)}
            larger = self._with_room(vector, program) or self._with_steps(vector, program)
            if larger is None:
                break
            program = self._program = larger
        return failed

    def _with_steps(self, vector: np.ndarray, program: Program) -> Program | None:
        """A program with twice the steps, if steps were too long for what the motion became: matter
        stiffens as it is pressed, which the bounds at its start do not foresee.
        """
        if self.problem.steps is not None:
            return None
        motion, _ = self.problem.call("motion", program)(
            self.problem.cast(vector), len(self.problem.times)
        )
        codes = set(np.asarray(motion.status.code).tolist()) - {OK}
        fewest = self.problem.program(vector, Program(0, program.capacities)).steps
        if not codes or codes - SHORTER or 2 * program.steps > MOST_DOUBLED * fewest:
            return None
        return Program(2 * program.steps, program.capacities)

    def _with_room(self, vector: np.ndarray, program: Program) -> Program | None:
        """A program with more room, if the pictures of a sound motion lacked it."""
        if not any(program.capacities):
            return None
        whole = len(self.problem.times)
        motion, look = self.problem.call("motion", program)(self.problem.cast(vector), whole)
        if np.any(np.asarray(motion.status.code) != OK):
            return None
        needed = self.problem.capacities(motion, look)
        if all(n <= c for n, c in zip(needed, program.capacities, strict=True)):
            return None
        return Program(
            program.steps,
            tuple(max(n, c) for n, c in zip(needed, program.capacities, strict=True)),
        )
