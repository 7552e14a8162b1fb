# Sourced by jobs: the tests that need Chromium.
pages=(tests/docs/test_notebook.py tests/render tests/sweeps/test_page.py)
