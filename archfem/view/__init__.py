"""Pictures and films of structures, what they did, and what they can take."""
