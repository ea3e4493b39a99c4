"""`python -m archfem` is the command line."""

import sys

from archfem.cli import main

sys.exit(main())
