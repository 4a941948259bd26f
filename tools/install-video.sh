#!/usr/bin/env bash
# ffmpeg of the distribution, for mp4 files; the extra `live` brings one of its own instead.
exec "$(dirname "$0")/install_apt.sh" "mp4 files" ffmpeg
