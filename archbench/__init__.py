"""Arch-Bench: scenes, references and programs for the collapse of dry-joint masonry, in one table.

Scenes are JSON, references TOML, and each program has an adapter of one function. Nothing here is
part of the package archfem, which is one of the programs. `docs/archbench.md` has the results,
`archbench/README.md` says how to add to them.
"""
