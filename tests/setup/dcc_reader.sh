#!/bin/sh
# Makes .venv-dcc with PyDCC and .venv-dcc-ptb with PTB's dccQuantities, readers of digital certificates by others, whose
# dependencies are none of ours. dccQuantities computes in .NET: Mono, of Debian or Ubuntu.
set -eu
[ -x .venv-dcc/bin/python ] || .venv/bin/python -m venv .venv-dcc
.venv-dcc/bin/python -c 'import dcc' 2>/dev/null || .venv-dcc/bin/python -m pip install --quiet --disable-pip-version-check 'pydcc==0.2.33'

if [ ! -e /usr/lib/mono/4.5/Facades/netstandard.dll ]; then
    install="apt-get install -y --no-install-recommends mono-devel libmono-system-windows-forms4.0-cil"
    if [ "$(id -u)" = 0 ]; then
        apt-get update -qq && $install
    elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
        sudo apt-get update -qq && sudo $install
    else
        echo "dccQuantities needs Mono: type 'sudo $install'; without it PyDCC alone reads the certificates" >&2
        exit 0
    fi
fi
# Made whole or not at all: the tests run where its Python stands.
if ! .venv-dcc-ptb/bin/python -c 'import importlib.metadata as installed; installed.version("dccQuantities")' 2>/dev/null; then
    .venv/bin/python -m venv .venv-dcc-ptb
    .venv-dcc-ptb/bin/python -m pip install --quiet --disable-pip-version-check 'dccQuantities==3.0.4' 'dcc-json-toolkit==1.2.5' ||
        { rm -rf .venv-dcc-ptb; exit 1; }
fi
