"""Cases on which structural dynamics with contact is known to break: `python -m hard`."""
