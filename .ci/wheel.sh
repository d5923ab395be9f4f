#!/usr/bin/env bash
# The sdist, the wheel built from it, and the wheel in an environment with the core alone, away
# from the checkout.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT

git clone -q "$ROOT" "$scratch/source"      # what is committed, nothing that was built here
"$VENV/bin/pip" install -q build
"$VENV/bin/python" -m build -o "$scratch/dist" "$scratch/source" >"$scratch/build.log" 2>&1 || {
    cat "$scratch/build.log"
    exit 1
}
ls "$scratch/dist"
wheel="$(echo "$scratch"/dist/mstmm-*-cp311-abi3-*.whl)"

python3 -m venv "$scratch/venv"
"$scratch/venv/bin/pip" install -q "$wheel"
mkdir "$scratch/elsewhere"
cd "$scratch/elsewhere"
PATH="$scratch/venv/bin:$PATH"
python "$ROOT/.ci/check_installed.py" "$ROOT"

echo "--- the demo with the core alone"
mstmm demo | tee demo.out
test -s demo.csv
grep -q 'mstmm\[' demo.out || grep -q "'\.\[" demo.out      # names the extra that it misses
mstmm show pin --at c >pin.c
test -s pin.c
mstmm list
