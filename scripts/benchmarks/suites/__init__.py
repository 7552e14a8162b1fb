"""Suites of MPCCs: how their rows become a page."""
