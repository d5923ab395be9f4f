# Sourced by .ci/run and by every step: strict mode, the project's root, headings with times.
set -euo pipefail
ROOT="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
export ROOT PIP_DISABLE_PIP_VERSION_CHECK=1 PYTHONUNBUFFERED=1 MPLBACKEND=Agg
VENV="$ROOT/.venv"
# The same C is compiled for every environment that is made here: the first one's objects serve the others.
export CCACHE_DIR="$ROOT/build/ccache" CCACHE_NOHASHDIR=1
[ ! -d /usr/lib/ccache ] || PATH="/usr/lib/ccache:$PATH"
cd "$ROOT"

# step TITLE COMMAND...: runs the command under a heading, prints its time, stops at a failure.
step() {
    local title="$1" begin=$SECONDS status=0
    shift
    printf '\n=== %s\n' "$title"
    "$@" || status=$?
    if [ "$status" -ne 0 ]; then
        printf '=== %s: FAILED (status %s) after %s s\n' "$title" "$status" "$((SECONDS - begin))"
        exit "$status"
    fi
    printf '=== %s: %s s\n' "$title" "$((SECONDS - begin))"
}

# together TITLE SCRIPT TITLE SCRIPT...: steps that keep one core busy each and share nothing that they write, as many
# at a time as there are cores.  What each prints appears when it has ended, in the order given.
together() {
    local logs pids=() status=0 i
    logs="$(mktemp -d)"
    while [ $# -gt 0 ]; do
        while [ "$(jobs -pr | wc -l)" -ge "$(nproc)" ]; do sleep 0.2; done
        step "$1" bash "$2" >"$logs/${#pids[@]}" 2>&1 &
        pids+=($!)
        shift 2
    done
    for i in "${!pids[@]}"; do
        wait "${pids[$i]}" || status=$?
        cat "$logs/$i"
    done
    rm -r "$logs"
    [ "$status" -eq 0 ] || exit "$status"
}
