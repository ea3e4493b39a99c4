"""`python -m archfem` is the command line."""

import sys

from archfem.cases.cli import main

sys.exit(main())
