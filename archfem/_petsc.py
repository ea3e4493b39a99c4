"""PETSc without its signal handlers, which turn a closed pipe or Ctrl-C into an MPI abort."""

import sys

import petsc4py

if "petsc4py.PETSc" not in sys.modules:
    petsc4py.init(["archfem", "-no_signal_handler"])

from petsc4py import PETSc as PETSc
