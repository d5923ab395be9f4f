#!/usr/bin/env bash
# Adds the development tools to the environment that the README's first command made.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

[ -x "$VENV/bin/python" ] || python3 -m venv "$VENV"
"$VENV/bin/pip" install -q -e '.[dev,docs]'
"$VENV/bin/pip" check
