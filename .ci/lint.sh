#!/usr/bin/env bash
# Style and types; import contracts are a test (tests/test_layout.py).
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

PATH="$VENV/bin:$PATH"
ruff check .
ruff format --check .
git ls-files -z '*.c' '*.h' ':!generated' ':!templates' | xargs -0 clang-format --dry-run --Werror
mypy
