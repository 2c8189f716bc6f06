#!/bin/sh
# How plugin_1_0.so was made (gcc 12.2, Debian 12, x86-64). Do not run it again:
# the point of the file is that it is never rebuilt.
set -eu
cd "$(dirname "$0")"
gcc -std=c11 -Wall -Wextra -Werror -pedantic -O2 -fPIC -fvisibility=hidden -shared \
    -Wl,--build-id=none -s -I ../../include -o plugin_1_0.so plugin_1_0.c
