#!/usr/bin/env bash
# The equations of everything that can be shown, compiled by pdflatex: no error, no line too wide.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

"$VENV/bin/python" tests/support/latex.py
