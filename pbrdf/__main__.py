"""`python -m pbrdf`: the command line."""

import sys

from pbrdf.cli import main

sys.exit(main())
