"""Files: scenarios, records, pedestrian tracks."""
