"""Studies: each names a claim and returns results; nothing here draws or writes files."""
