#!/bin/sh
# Builds a program of cargo's into target/tools, or does nothing where it is there. Cargo.lock of the program fixes what it is of.
#   tools/tool.sh NAME VERSION
set -eu
cd "$(dirname "$0")/.."
"target/tools/bin/$1" --version 2>/dev/null | grep -q "$2" && exit 0
echo "building $1 $2 into target/tools"
cargo install --quiet --locked --root target/tools --version "$2" "$1"
