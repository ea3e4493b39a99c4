"""Changed physics, one place at a time: do the default tests notice?"""
