#!/bin/sh
# Installs what the tests of the page, the firmware and the study store need from the system, where that can be done: Debian or Ubuntu, as root.
# Elsewhere it says what will be skipped. It never fails a run by itself: under CI=true the tests that miss a tool do.
set -u

missing=""
need() { # need PACKAGE CHECK...: PACKAGE is missing where CHECK fails
    package=$1
    shift
    "$@" >/dev/null 2>&1 || missing="$missing $package"
}

browser() {
    for each in chromium chromium-browser google-chrome google-chrome-stable; do
        command -v "$each" && return 0
    done
    return 1
}

[ "$(uname -s)" = Linux ] || {
    browser >/dev/null || echo "No Chromium on PATH: the browser tests will be skipped."
    exit 0
}

need chromium browser
need poppler-utils command -v pdftoppm
postgres() { # Debian keeps the server's programs out of PATH
    for each in /usr/lib/postgresql/*/bin/initdb; do
        [ -x "$each" ] && return 0
    done
    command -v initdb
}
need postgresql postgres
if command -v dpkg-query >/dev/null 2>&1; then
    installed() { dpkg-query -W -f '${Status}' "$1" 2>/dev/null | grep -q 'ok installed'; }
    for each in libegl1 libgl1-mesa-dri libgles2; do
        need "$each" installed "$each"
    done
    # The firmware: its compiler and the Arduino core, and the simulated board that runs it.
    for each in arduino-core-avr gcc-avr avr-libc arduino-builder libsimavr-dev libelf-dev gcc g++ make; do
        need "$each" installed "$each"
    done
fi
[ -n "$missing" ] || exit 0

if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
    echo "Installing$missing ..."
    export DEBIAN_FRONTEND=noninteractive
    # shellcheck disable=SC2086  # a list of names
    apt-get update -qq && apt-get install -y -qq --no-install-recommends $missing >/dev/null && exit 0
    echo "apt-get could not install$missing: the tests that need them may be skipped." >&2
else
    echo "Missing:$missing. Tests that need them are skipped; on Debian: sudo apt-get install$missing"
fi
exit 0
