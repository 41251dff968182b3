import os
from pathlib import Path

# Compiled programs are kept between runs: the suite compiles far more than it computes.
os.environ.setdefault(
    "JAX_COMPILATION_CACHE_DIR", str(Path.home() / ".cache" / "jaxphys-tests" / "jit")
)
os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.3")
os.environ.setdefault("JAX_PLATFORMS", "cpu")
# Programs read back from the cache are compared with the host feature by feature, at length.
os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")

import jax
from hypothesis import settings

jax.config.update("jax_enable_x64", True)
settings.register_profile("suite", deadline=None, max_examples=20, derandomize=True)
settings.load_profile("suite")
