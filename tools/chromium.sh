#!/bin/sh
# Makes sure that a Chromium is there, which the tests of the report page need. Says nothing where it is.
set -eu
for name in chromium chromium-browser google-chrome; do
    if command -v "$name" >/dev/null; then
        exit 0
    fi
done
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "installing chromium"
    apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends chromium >/dev/null
else
    echo "error: the tests need Chromium: on Debian, sudo apt-get install chromium; elsewhere Chrome will do" >&2
    exit 1
fi
