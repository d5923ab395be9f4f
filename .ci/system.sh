#!/usr/bin/env bash
# What pip cannot bring: Python with venv and headers, C compilers and a cache of theirs, a browser, LaTeX.
# Installs only what is missing.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

missing=()
command -v python3 >/dev/null || missing+=(python3)
command -v gcc >/dev/null || missing+=(gcc)
command -v clang >/dev/null || missing+=(clang)      # the second opinion on warnings
command -v ccache >/dev/null || missing+=(ccache)    # what one step compiles serves the next
command -v git >/dev/null || missing+=(git)
command -v chromium >/dev/null || missing+=(chromium)  # pages are opened and looked at
command -v pdflatex >/dev/null || missing+=(texlive-latex-base)  # equations are compiled
[ -e /usr/include/stdlib.h ] || missing+=(libc6-dev)
python3 -c 'import ensurepip, venv' 2>/dev/null || missing+=(python3-venv)
python3 -c 'import os, sysconfig; os.stat(sysconfig.get_paths()["include"] + "/Python.h")' \
    2>/dev/null || missing+=(python3-dev)

if [ "${#missing[@]}" -gt 0 ]; then
    echo "installing ${missing[*]}"
    as_root=()
    [ "$(id -u)" -eq 0 ] || as_root=(sudo)
    "${as_root[@]}" apt-get update -qq
    DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}"
fi

python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' || {
    echo "Python 3.11 or newer is needed, found $(python3 --version)"
    exit 3
}
python3 --version
gcc --version | head -n 1
