"""How every kernel is compiled."""

from __future__ import annotations

from typing import Any

KERNEL: dict[str, Any] = {"cache": True, "error_model": "numpy", "no_cfunc_wrapper": True}
"""Of `numba.njit`: kept on disk; x/0 is inf or nan; nobody calls kernels from C, and what they would need for it takes
a tenth of the time of compiling."""
