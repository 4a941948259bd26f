"""What all tests share: no test is judged by the clock, and every example can be repeated."""

from __future__ import annotations

import os

from hypothesis import settings

settings.register_profile("sidestep", deadline=None, max_examples=60, derandomize=True, print_blob=True)
settings.register_profile("long", deadline=None, max_examples=1000)
settings.load_profile(os.environ.get("SIDESTEP_HYPOTHESIS", "sidestep"))
