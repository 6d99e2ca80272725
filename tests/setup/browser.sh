#!/bin/sh
# What make pages needs besides: Playwright and axe-core in .venv, and Debian's or Ubuntu's Chromium. No browser is fetched from elsewhere.
set -eu
cd "$(dirname "$0")/../.."

.venv/bin/python -c 'import playwright, axe_playwright_python' 2>/dev/null ||
    .venv/bin/python -m pip install --quiet -c constraints.txt playwright axe-playwright-python
if [ -z "${CHROMIUM:-}" ] && ! command -v chromium >/dev/null && ! command -v chromium-browser >/dev/null; then
    install="apt-get install -y --no-install-recommends chromium"
    if [ "$(id -u)" = 0 ]; then
        apt-get update -qq && $install
    elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
        sudo apt-get update -qq && sudo $install
    else
        echo "The pages are looked at with Chromium: type 'sudo $install', or set CHROMIUM=/path/to/chromium" >&2
        exit 3
    fi
fi
