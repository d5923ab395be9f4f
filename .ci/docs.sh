#!/usr/bin/env bash
# Builds the pages and looks where their links lead; a warning is an error.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

"$VENV/bin/python" -m sphinx -q -E -W --keep-going docs build/docs
"$VENV/bin/python" .ci/check_site.py build/docs
