"""The robot's problem (Eq. 9), its global search, its polish, and the plan."""
