"""Optimal control problems, each posed to fesd-robot and to nosnoc from one description; see ../compare_nosnoc.py."""
