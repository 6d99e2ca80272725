#!/bin/sh
# Makes .venv-store with moto, an object store that speaks S3, whose dependencies contradict our pins.
set -eu
[ -x .venv-store/bin/python ] || .venv/bin/python -m venv .venv-store
.venv-store/bin/python -c 'import moto.server, flask' 2>/dev/null || .venv-store/bin/python -m pip install --quiet --disable-pip-version-check 'moto[server,s3]==5.2.5'
