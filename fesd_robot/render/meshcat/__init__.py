"""Meshcat's description of scenes and its viewer, unchanged; README.md says which parts, and why they are here."""
