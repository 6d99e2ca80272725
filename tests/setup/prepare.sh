#!/bin/sh
# What every make target needs first: a virtual environment in .venv with everything in it, made once.
# When nothing has changed since, this takes a few hundredths of a second. PYTHON=/path/to/python chooses the Python.
set -eu
cd "$(dirname "$0")/../.."

# A change of any of these, or of the place of the checkout, asks for a new look at the environment.
state() {
    {
        pwd -P
        cat pyproject.toml constraints.txt tests/setup/hashes.txt tests/setup/prepare.sh tests/setup/environment.py
        grep '^__version__' monitor/__init__.py
    } | sha256sum
}

wanted=$(state)
if [ "$(cat .venv/.ready 2>/dev/null)" = "$wanted" ] && .venv/bin/python -I -S -c '' 2>/dev/null; then
    exit 0
fi

# A name on the PATH may be a wrapper that runs nothing, and a system's Python may come without ensurepip:
# take the first that has all, else the first that is new enough (environment.py then sees to ensurepip).
chosen=
found=
for name in ${PYTHON:-python3.13 python3.12 python3.11 python3 python3.14}; do
    version=$("$name" -I -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null) || continue
    found="$found $name ($version)"
    "$name" -I -c 'import sys; sys.exit(sys.version_info < (3, 11))' || continue
    if "$name" -I -c 'import ensurepip, venv' 2>/dev/null; then
        chosen=$name
        break
    fi
    [ -n "$chosen" ] || chosen=$name
done
if [ -z "$chosen" ]; then
    echo "Set-up stopped: Python 3.11 or later is needed; found:${found:- none}." >&2
    echo "Install one (Debian 12, Ubuntu 24.04 or later: apt-get install python3 python3-venv)," >&2
    echo "or name one that is elsewhere: make PYTHON=/path/to/python3.12 ${MAKECMDGOALS:-test}" >&2
    exit 3
fi

rm -f .venv/.ready
"$chosen" -I tests/setup/environment.py
echo "$wanted" >.venv/.ready
