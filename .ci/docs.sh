#!/usr/bin/env bash
# Builds the pages and the reference; a warning is an error.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

"$VENV/bin/python" -m sphinx -q -E -W --keep-going docs build/docs
