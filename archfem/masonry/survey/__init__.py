"""Structures from drawings: outlines as people draw them, made to touch, as blocks."""
