#!/bin/sh
# Makes sure that ffmpeg and ffprobe are there, which the tests of video need. Says nothing where they are.
set -eu
if command -v ffmpeg >/dev/null && command -v ffprobe >/dev/null; then
    exit 0
fi
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "installing ffmpeg"
    apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends ffmpeg >/dev/null
else
    echo "error: the tests need ffmpeg: on Debian or Ubuntu, sudo apt-get install ffmpeg; on macOS, brew install ffmpeg" >&2
    exit 1
fi
