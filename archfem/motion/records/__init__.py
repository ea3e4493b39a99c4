"""Files of recorded ground motions: one module for each format, found by content."""
