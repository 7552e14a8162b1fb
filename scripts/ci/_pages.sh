# Sourced by jobs: the tests that need Chromium.
pages=(tests/docs/test_notebook.py tests/render tests/scripts/test_gallery.py tests/sweeps/test_page.py)
