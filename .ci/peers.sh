#!/usr/bin/env bash
# Comparisons with Pinocchio, MuJoCo and Exudyn, in an environment of their own.  It shares the checkout and
# its compiled extension, which is one binary for both.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

peers="$ROOT/.venv-peers"
[ -x "$peers/bin/python" ] || python3 -m venv "$peers"
"$peers/bin/pip" install -q -e '.[peers]'
"$peers/bin/python" -m pytest -q -n logical --dist loadfile tests/peers
