"""A plan driven again: rigid bodies with Coulomb friction, event by event, knowing nothing of how it was planned."""
