"""Peers that run in environments of their own, which a variable names (docs/benchmarks/peers.md).

Nothing here imports a peer: its worker is a module that the peer's interpreter runs, spoken to as
`protocol` says.
"""

import json
import os
import selectors
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import numpy as np

from benchmarks.peers.protocol import ENDS, Matter

ROOT = Path(__file__).resolve().parents[2]
LIMIT_SECONDS = 600.0


class PeerError(Exception):
    """What came of a peer instead of an answer, in one line."""


@dataclass(frozen=True)
class Peer:
    """A peer: how tables call it, the variable that names its interpreter, its worker, and what
    that interpreter must have installed.
    """

    name: str
    variable: str
    module: str
    packages: str

    @property
    def interpreter(self) -> str | None:
        """The interpreter to run it by; None where there is none."""
        named = os.environ.get(self.variable, "")
        return named if named and Path(named).is_file() else None

    @property
    def missing(self) -> str:
        """Why it cannot be run, and what to do; empty where it can."""
        named = os.environ.get(self.variable, "")
        if self.interpreter:
            return ""
        why = f"names {named}, which is no file" if named else "is not set"
        return (
            f"{self.name} left out: {self.variable} {why}; set it to a Python that has "
            f"{self.packages}"
        )


GENESIS = Peer(
    "genesis", "JAXPHYS_GENESIS_PYTHON", "benchmarks.peers.genesis_mpm", "genesis-world and torch"
)
NEWTON = Peer("newton", "JAXPHYS_NEWTON_PYTHON", "benchmarks.peers.newton_mpm", "newton")
PEERS = (GENESIS, NEWTON)


class Session:
    """A peer's process, which is told a problem and runs it as often as wanted.

    Attributes:
        ready: what it said of the last problem: `seconds` of building, `steps`, `law`, `versions`.
    """

    def __init__(self, peer: Peer, limit: float = LIMIT_SECONDS):
        """Starts the process.

        Args:
            limit: seconds for any one answer.

        Raises:
            PeerError: The peer is missing.
        """
        if peer.interpreter is None:
            raise PeerError(peer.missing)
        self._name, self._limit = peer.name, limit
        self._folder = tempfile.TemporaryDirectory()
        self._problem = Path(self._folder.name) / "problem.npz"
        self._end, self._said = self._problem.with_name("end.npz"), self._problem.with_name("said")
        reading, writing = os.pipe()
        with self._said.open("wb") as said:
            self._process = subprocess.Popen(
                [peer.interpreter, "-m", peer.module, str(self._end), str(writing)],
                cwd=ROOT,
                env={key: value for key, value in os.environ.items() if key != "PYTHONPATH"},
                stdin=subprocess.PIPE,
                stdout=said,
                stderr=said,
                pass_fds=(writing,),
            )
        os.close(writing)
        self._answers = os.fdopen(reading, "rb")
        self.ready: dict = {}

    def __enter__(self) -> "Session":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def load(self, matter: Matter) -> None:
        """Builds the problem there.

        Raises:
            PeerError: It refuses the problem, it crashed, or it took too long.
        """
        matter.save(self._problem)
        self.ready = self._asked(f"load {self._problem}")

    def run(self) -> dict:
        """Runs the problem from its start: `seconds` of it and `peak_bytes` of the process.

        Raises:
            PeerError: as `load`.
        """
        return self._asked("run")

    def end(self) -> dict[str, np.ndarray]:
        """Position, velocity, affine and deformation after the last run, as in `Matter`."""
        with np.load(self._end) as saved:
            return {name: np.asarray(saved[name], np.float64) for name in ENDS}

    @property
    def alive(self) -> bool:
        """Whether it can be asked again."""
        return self._process.poll() is None

    @property
    def said(self) -> str:
        """All that it printed but its answers."""
        return self._said.read_text(errors="replace")

    def close(self) -> None:
        """Ends the process."""
        self._process.kill()
        self._process.communicate()
        self._answers.close()
        self._folder.cleanup()

    def _asked(self, line: str) -> dict:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(f"{line}\n".encode())
            self._process.stdin.flush()
        except BrokenPipeError:
            raise PeerError(self._last_words()) from None
        with selectors.DefaultSelector() as selector:
            selector.register(self._answers, selectors.EVENT_READ)
            if not selector.select(self._limit):
                self._process.kill()
                raise PeerError(f"{self._name}: no answer within {self._limit:g} s")
        line = self._answers.readline()
        if not line:
            raise PeerError(self._last_words())
        answer = json.loads(line)
        if answer["status"] == "error":
            raise PeerError(f"{self._name}: {answer.get('kind', 'Error')}: {answer['message']}")
        return answer

    def _last_words(self) -> str:
        code = self._process.wait()
        last = ([line for line in self.said.splitlines() if line.strip()] or ["no output"])[-1]
        return f"{self._name}: exit {code}: {last.strip()[:300]}"
