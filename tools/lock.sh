#!/bin/sh
# Writes requirements.lock and requirements-dev.lock from pyproject.toml: one version for every system and Python.
# Versions that are locked already stay, unless UPGRADE=1. Needs a network.
set -eu

cd "$(dirname "$0")/.."
python=${PYTHON:-python3}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT INT TERM

"$python" -m venv "$scratch/venv"
"$scratch/venv/bin/python" -m pip install --quiet --disable-pip-version-check uv

compile() { # compile OUTPUT OPTIONS...
    output=$1
    shift
    [ "${UPGRADE:-0}" = 0 ] || set -- --upgrade "$@"
    cp "$output" "$scratch/$output" 2>/dev/null || true
    "$scratch/venv/bin/uv" pip compile --quiet --universal --python-version 3.11 --fork-strategy fewest \
        --no-header --no-annotate --no-emit-index-url --no-emit-find-links \
        --output-file "$scratch/$output" "$@" pyproject.toml >/dev/null
    mv "$scratch/$output" "$output"
    echo "$output: $(grep -c == "$output") packages"
}

compile requirements.lock
compile requirements-dev.lock --extra dev --constraint requirements.lock
