"""The commands: parse, call one function, report, return an exit code."""

import os

# The solver's matrices are too small to share: threads of the linear algebra would only wait for one another.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
