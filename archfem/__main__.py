"""`python -m archfem` is the command line."""

import sys

from archfem.commands.line import main

sys.exit(main())
