#!/usr/bin/env bash
# generated/ is what derive/ gives, byte for byte, whatever the seed of Python's hashes.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

for seed in 1 4294967295; do
    echo "--- PYTHONHASHSEED=$seed"
    PYTHONHASHSEED=$seed "$VENV/bin/mstmm" generate --check
done
