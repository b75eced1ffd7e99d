#!/bin/sh
# Installs the wheel of dist/ into an empty environment in an empty folder, without Rust, and uses it.
set -eu
cd "$(dirname "$0")/.."
wheel=$(ls "$PWD"/dist/*.whl)
own=$PWD/.venv-dist/bin/python
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
"$own" -m venv env
env/bin/python -m pip install --quiet --disable-pip-version-check "$wheel"

# Nothing of this machine's own: no Rust, no tools, no folder of the project.
try() { env -i PATH="$folder/env/bin:/usr/bin:/bin" HOME="$folder" "$@"; }
test "$(try python -m pip list --format=freeze --disable-pip-version-check | grep -vc -e '^pip=' -e '^setuptools=')" = 2
try python -c 'import apgstmd, sys; print("apgstmd", apgstmd.__version__, "from", apgstmd.__file__)
assert apgstmd.__file__.startswith(sys.prefix)
scene = apgstmd.synth("demo")
found = apgstmd.run(scene, speed=1.0, stop=120)
area = apgstmd.evaluate(found, scene).area
print(found, f"area {area:.3f}")
assert area > 0.5
bank = apgstmd.Bank((64, 96))
assert bank.process(scene[0][:64, :96]).response.shape == (64, 96)'
try apgstmd --version | head -1
try python -m apgstmd --help > help.txt
grep -q 'apgstmd run' help.txt
try apgstmd demo --out demo --quiet
test -s demo/detections.csv && test -s demo/run.json
echo "the wheel works: module, console script, demo"
