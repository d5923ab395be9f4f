#!/usr/bin/env bash
# The generated C under strict warnings, then under the address and undefined-behaviour sanitizers:
# every kernel by a small driver, and the engine by the tests that exercise it from Python.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
strict=(-std=c17 -Wall -Wextra -Wpedantic -Wshadow -Wstrict-prototypes -Werror)
sanitize=(-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)

echo "--- warnings as errors"
for compiler in gcc clang; do
    for source in generated/*.c; do
        "$compiler" "${strict[@]}" -O2 -Igenerated -c "$source" -o /dev/null
    done
done

echo "--- every kernel, sanitized"
gcc -std=c17 -g -O1 "${sanitize[@]}" -Igenerated generated/*.c .ci/sanitize_kernels.c -lm -o "$scratch/kernels"
"$scratch/kernels"
