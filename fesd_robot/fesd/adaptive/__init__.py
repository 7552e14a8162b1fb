"""Simulation with steps of its own choice, from switch to switch."""
