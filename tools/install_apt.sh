#!/usr/bin/env bash
# Install the named Debian packages that are missing. Usage: install_apt.sh WHAT-FOR PACKAGE...
# Nothing is done when all are there; without root or apt it says what is missing and leaves with status 0,
# because everything that needs them is optional.
set -euo pipefail
what=$1
shift
missing=()
for package in "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
if [ ${#missing[@]} = 0 ]; then
    echo "$what: all installed"
elif ! command -v apt-get >/dev/null; then
    echo "$what: skipped, there is no apt here; it would need: ${missing[*]}" >&2
elif [ "$(id -u)" != 0 ]; then
    echo "$what: skipped, not root; to install: sudo apt-get install ${missing[*]}" >&2
else
    echo "$what: installing ${missing[*]}"
    exec 9>"${TMPDIR:-/tmp}/sidestep-apt.lock"
    flock 9 # apt takes one caller at a time, and does not wait
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
fi
