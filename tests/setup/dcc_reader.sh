#!/bin/sh
# Makes .venv-dcc with PyDCC, a reader of digital certificates by others, whose dependencies are none of ours.
set -eu
[ -x .venv-dcc/bin/python ] || .venv/bin/python -m venv .venv-dcc
.venv-dcc/bin/python -c 'import dcc' 2>/dev/null || .venv-dcc/bin/python -m pip install --quiet --disable-pip-version-check 'pydcc==0.2.33'
