#!/bin/sh
# Makes an environment, .venv with what the tests need unless told otherwise, or does nothing where it is up to date.
#   tools/venv.sh [FOLDER REQUIREMENTS]
set -eu
cd "$(dirname "$0")/.."
venv=${1:-.venv}
named=${2:-tools/requirements-test.txt}
# Everything that those bring too, with hashes: see tools/lock.sh.
wanted=$(dirname "$named")/locked-$(basename "$named")
installed=$venv/requirements.txt

for pin in $(grep '==' "$named"); do
    grep -qiF "$pin" "$wanted" || { echo "error: $wanted lacks $pin: run tools/lock.sh" >&2; exit 1; }
done
if cmp -s "$wanted" "$installed" && "$venv/bin/python" -c 'import numpy, pytest' 2>/dev/null; then
    exit 0
fi

# The newest name first would pick pre-releases; the plain name is what the user set up.
for python in ${PYTHON:-python3 python3.11 python3.12 python3.13 python3.14}; do
    "$python" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && break
    python=
done
if [ -z "$python" ]; then
    echo "error: no Python 3.11 or newer found: install one, or name it: make test PYTHON=/path/to/python3" >&2
    exit 1
fi

# Debian and Ubuntu ship Python without these two modules.
if ! "$python" -c 'import venv, ensurepip' 2>/dev/null; then
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        echo "installing python3-venv"
        apt-get update -qq && apt-get install -y -qq python3-venv >/dev/null
    else
        echo "error: this Python cannot make virtual environments: on Debian or Ubuntu, sudo apt-get install python3-venv" >&2
        exit 1
    fi
fi

echo "making $venv with $("$python" --version)"
"$python" -m venv --clear "$venv"
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check --require-hashes --requirement "$wanted"
cp "$wanted" "$installed"
