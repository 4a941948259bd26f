"""From scans to people with identity and velocity."""
