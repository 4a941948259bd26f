#!/usr/bin/env bash
# Print NAME==VERSION as pinned in a requirements file, for each NAME. Usage: pinned.sh FILE NAME...
set -euo pipefail
file=$1
shift
for name in "$@"; do
    grep -m1 -oE "^$name==[^ ;]+" "$file" || { echo "pinned.sh: $name is not in $file" >&2; exit 1; }
done
