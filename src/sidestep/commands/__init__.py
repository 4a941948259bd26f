"""One module per command of `sidestep`, imported when it is called; each imports its own heavy parts late."""
