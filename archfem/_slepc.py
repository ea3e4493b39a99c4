"""SLEPc, on a PETSc that was set up without its signal handlers."""

import sys

import slepc4py

from archfem._petsc import PETSc as PETSc

if "slepc4py.SLEPc" not in sys.modules:
    slepc4py.init(["archfem", "-no_signal_handler"])

from slepc4py import SLEPc as SLEPc
