#!/usr/bin/env bash
# Tests with the lowest versions that pyproject.toml permits, in an environment of their own: to be
# run when a bound changes, no step of .ci/run.  Arguments go to pytest; without them the whole suite.
# PYTHON names another interpreter than python3.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

lowest="$ROOT/.venv-lowest"
requirements="$lowest/requirements.txt"
"${PYTHON:-python3}" -m venv --clear "$lowest"
"$lowest/bin/pip" install -q uv
# What pip would take for what is not ours, and no version that has no binary for this Python.
"$lowest/bin/uv" pip compile -q --python "$lowest/bin/python" --resolution lowest-direct \
    --only-binary :all: --extra test -o "$requirements" pyproject.toml
"$lowest/bin/pip" install -q -r "$requirements"
"$lowest/bin/pip" install -q --no-deps -e .
PATH="$lowest/bin:$PATH" "$lowest/bin/python" -m pytest -q "$@"
