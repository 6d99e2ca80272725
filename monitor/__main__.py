"""``python -m monitor``, where the command is not on the path."""

import sys

from monitor.cli import main

sys.exit(main())
