"""`python -m archfem` is the command line."""

import sys

from archfem.commands.cli import main

sys.exit(main())
