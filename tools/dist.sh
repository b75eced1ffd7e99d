#!/bin/sh
# Builds dist/: a wheel for every Python from 3.11 on and every Linux with glibc 2.28 (2018), and the source archive.
set -eu
cd "$(dirname "$0")/.."
python=$PWD/.venv-dist/bin/python
most=10000000

rm -rf dist
# zig links against an old glibc, so that the wheel runs on older systems than this one.
PATH=$PWD/.venv-dist/bin:$PATH "$python" -m maturin build --release --quiet --sdist --zig --compatibility manylinux_2_28 \
    --interpreter "$python" --out dist
"$python" -m twine check --strict dist/*
"$python" -m abi3audit --strict --report dist/*.whl > dist/abi3audit.json || { cat dist/abi3audit.json; exit 1; }
rm dist/abi3audit.json
for file in dist/*; do
    size=$(wc -c < "$file")
    echo "$file: $size bytes"
    if [ "$size" -gt "$most" ]; then
        echo "error: $file has more than $most bytes" >&2
        exit 1
    fi
done
