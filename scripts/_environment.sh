# Sourced by the other scripts: a virtual environment in .venv with the package and the extras named in $1.
# Works on a machine that has only Python >= 3.10 with pip and venv; everything else comes from package registries.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$root"
python=${PYTHON:-python3}
if ! "$python" -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; then
    echo "error: $python is missing or older than 3.10; set PYTHON to a newer one" >&2
    exit 1
fi
if [ ! -x .venv/bin/python ]; then
    "$python" -m venv .venv || { echo "error: '$python -m venv' failed; install Python's venv module" >&2; exit 1; }
fi
stamp=".venv/.installed-$(printf '%s' "${1:-}" | tr -c 'a-z' '-')"
if [ ! -e "$stamp" ] || [ pyproject.toml -nt "$stamp" ]; then
    echo "installing the program and what it needs into $root/.venv; the first time takes half a minute and 1.2 GB" >&2
    .venv/bin/python -m pip install --quiet --disable-pip-version-check -e ".${1:+[$1]}"
    touch "$stamp"
fi
# One thread for the linear solver: its problems are too small to gain from more.
export OMP_NUM_THREADS=${OMP_NUM_THREADS:-1}
