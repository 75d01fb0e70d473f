#!/usr/bin/env bash
# No large file is committed: what programs make stays out, and pictures in the pages are small. Nothing to check without git.
# usage: check_sizes.sh ROOT
set -euo pipefail
cd -- "$1"
readonly most_bytes=300000

git rev-parse --is-inside-work-tree >/dev/null 2>&1 || exit 0
large=$(git ls-files -z | xargs -0 -r stat --format '%s %n' -- 2>/dev/null | awk -v most="$most_bytes" '$1 > most') || true
[[ -z $large ]] && exit 0
echo "check_sizes: committed, and larger than $most_bytes bytes:" >&2
echo "$large" >&2
exit 1
