#!/usr/bin/env bash
# Runs a set-up command of README.md exactly as printed there: the first block marked `sh` installs
# and runs ("run"), the second one installs and tests ("test").
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

case "${1:-}" in
    run) number=1 ;;
    test) number=2 ;;
    *) echo "usage: readme.sh run|test" && exit 2 ;;
esac
block="$(awk -v n="$number" '/^```sh$/ { k++; inside = 1; next } /^```/ { inside = 0 } inside && k == n' README.md)"
[ -n "$block" ] || { echo "README.md has no block $number"; exit 1; }
echo "$block"
[ "$number" -eq 1 ] || source "$VENV/bin/activate"
bash -euo pipefail -c "$block"
