"""The paper's evaluation with the parts that are here: `python -m experiments.paper`."""

import os

# Programs read back from where they are kept are compared with the host feature by feature, at
# length on standard error; to be set before JAX is imported.
os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
