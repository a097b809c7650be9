#!/bin/sh
# Checks that clang-format 14 would not change any C or C++ file. Exit code 77 (skipped) if it is not installed.
# usage: check-format.sh [ROOT]
cd "${1:-$(dirname "$0")/..}" || exit 2
tool=clang-format-14
command -v $tool >/dev/null || tool=clang-format
$tool --version 2>/dev/null | grep -q 'version 14\.' || { echo "clang-format 14 is not installed"; exit 77; }
find base mesh dual cluster partition bvh scene radiosity simplify tools include tests bench examples \
    \( -name '*.c' -o -name '*.h' -o -name '*.cpp' -o -name '*.hpp' \) 2>/dev/null | sort |
    xargs $tool --dry-run -Werror
