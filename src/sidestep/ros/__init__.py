"""Robot nodes, thin over the same core."""
