#!/bin/sh
# Writes, for each file of pinned Python tools, one that also names everything they bring, with the hash of every wheel, for any
# machine and any Python from 3.11 on. tools/venv.sh installs these. Run it after changing a pin.
#   tools/lock.sh [FILE...]
set -eu
cd "$(dirname "$0")/.."
[ $# -gt 0 ] || set -- tools/requirements-*.txt benches/compare/requirements.txt
uv=target/tools/uv/bin/uv
if ! "$uv" --version 2>/dev/null | grep -q '0\.13\.9'; then
    python3 -m venv target/tools/uv
    target/tools/uv/bin/python -m pip install --quiet --disable-pip-version-check uv==0.13.9
fi
for file; do
    locked=$(dirname "$file")/locked-$(basename "$file")
    UV_NO_CONFIG=1 "$uv" pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-annotate \
        --no-header --output-file "$locked" "$file"
    sed -i '1i # Written by tools/lock.sh from the file of the same name: change that one.' "$locked"
    echo "$locked"
done
