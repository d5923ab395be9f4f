#!/usr/bin/env bash
# The C of all packages under strict warnings, then under the address and undefined-behaviour sanitizers:
# every kernel by a small driver, and the engine by the tests that exercise it from Python.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
strict=(@compile_flags.txt -Wall -Wextra -Wpedantic -Wshadow -Wstrict-prototypes -Werror)
# The address sanitizer reports the accesses that the three excluded checks warn of.
sanitize=(-fsanitize=address,undefined -fno-sanitize=null,pointer-overflow,object-size
    -fno-sanitize-recover=all -fno-omit-frame-pointer)
sources=(generated/*.c runtime/*/c/*.c)
modules=(runtime/*/*/c/*.c)                  # call Python and numpy: no part of the driver
headers=(-isystem "$("$VENV/bin/python" -c 'import sysconfig; print(sysconfig.get_paths()["include"])')"
    -isystem "$("$VENV/bin/python" -c 'import numpy; print(numpy.get_include())')")

echo "--- warnings as errors: clang"
printf '%s\0' "${sources[@]}" "${modules[@]}" |
    xargs -0 -n 8 -P "$(nproc)" clang "${strict[@]}" "${headers[@]}" -fsyntax-only

echo "--- warnings as errors: gcc; every kernel, sanitized"
git clone -q "$ROOT" "$scratch/checkout"
cd "$scratch/checkout"
# Lines for what a sanitizer reports; the largest functions are beyond what gcc tracks the variables of.
printf '#!/bin/sh\nexec gcc "$@" %s\n' "-O1 -g1 -fno-var-tracking ${sanitize[*]}" >"$scratch/cc"
# Of what is compiled here cffi's own file is not ours to warn of.
cat >"$scratch/strict" <<EOF
#!/bin/sh
case "\$*" in *._kernels.c*) ;; *" -c "*) set -- "\$@" ${strict[*]} ${headers[*]} ;; esac
exec "$scratch/cc" "\$@"
EOF
chmod +x "$scratch/cc" "$scratch/strict"
export PYTHONPATH="$scratch/checkout" ASAN_OPTIONS=detect_leaks=0
CC="$scratch/strict" "$VENV/bin/python" setup.py -q build_ext --inplace
export CC="$scratch/cc"
objects=(build/temp.*/generated/*.o build/temp.*/runtime/*/c/*.o)       # those without Python
"$scratch/cc" "${strict[@]}" .ci/sanitize_kernels.c "${objects[@]}" -lm -o "$scratch/kernels"
"$scratch/kernels"

echo "--- the engine under its tests, sanitized"
# sanitized_tests.txt: of 148 files that call the engine, those that together reach every branch of the C that all of
# them reach (gcov, 2026-11-30), and some that compile C of their own.  Memory is counted without a sanitizer.
# libstdc++ as well: extensions of other packages throw C++ exceptions
sanitized() {
    LD_PRELOAD="$(gcc -print-file-name=libasan.so) $(gcc -print-file-name=libstdc++.so.6)" "$VENV/bin/python" -m "$@"
}
sanitized pytest -q -n logical --dist loadfile -p no:cacheprovider @.ci/sanitized_tests.txt

echo "--- changed scenes, sanitized"
sanitized tests.fuzz \
    --count 15 --seed 9 --first 43 --memory 0 --cpu 120 --keep "$scratch/found"
