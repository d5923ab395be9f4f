#!/usr/bin/env bash
# Runs every example; each checks its own statement.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
cd "$scratch"                               # what an example writes stays out of the checkout
count=0
for script in "$ROOT"/examples/*/check.py; do
    printf '%s: ' "$(basename "$(dirname "$script")")"
    "$VENV/bin/python" -W error "$script"
    count=$((count + 1))
done
[ "$count" -gt 0 ]
echo "$count examples"
